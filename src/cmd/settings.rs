use super::common::SettingsArgs;
use super::{Context, Outcome, output};
use crate::config::{Explained, Stage, explain};
use crate::error::Result;
use crate::report::table::wrapped;

/// Print the resolved settings of a task as TOML, itself a valid pipeline file.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  hilt settings --task stack > mine.toml\n  hilt settings --explain train.tau\n  hilt settings --explain simulate --task tower"
)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Only the sections that this stage reads: plan, simulate, convert, pretrain, train or evaluate
    #[arg(long, value_name = "STAGE")]
    stage: Option<Stage>,
    /// Explain a key, a section or all of them instead: meaning, unit, what is allowed, the default, what each preset says, and what was measured
    #[arg(long, value_name = "KEY", num_args = 0..=1, default_missing_value = "", conflicts_with = "stage")]
    explain: Option<String>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    args.settings.places(&context.console).check(&context.console)?;
    if let Some(asked) = &args.explain {
        let explained = explain(asked, args.settings.task()?.as_ref())?;
        let width = output::width();
        let lines = |one: &Explained| one.to_string().lines().map(|line| wrapped(line, width)).collect::<String>();
        return output::print(&explained.iter().map(lines).collect::<Vec<_>>().join("\n")).map(|()| Outcome::Done);
    }
    let pipeline = args.settings.resolve(&[])?;
    // What the files of a robot say belongs to the settings, as `make` compares them.
    let robot = &pipeline.robot;
    let content = if robot.is_default() { String::new() } else { format!("# robot {} {}\n", robot.name, robot.content()) };
    output::print(&format!("# seed {}\n{content}{}", args.settings.seed, pipeline.to_toml(args.stage)?))?;
    Ok(Outcome::Done)
}
