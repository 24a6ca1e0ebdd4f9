use super::common::SettingsArgs;
use super::{Context, Outcome, output};
use crate::config::Stage;
use crate::error::Result;

/// Print the resolved settings of a task as TOML, itself a valid pipeline file.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Only the sections that this stage reads: plan, simulate, convert, pretrain, train or evaluate
    #[arg(long, value_name = "STAGE")]
    stage: Option<Stage>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    args.settings.places().check(&context.console)?;
    let pipeline = args.settings.resolve(&[])?;
    // What the files of a robot say belongs to the settings, as `make` compares them.
    let robot = &pipeline.robot;
    let content = if robot.is_default() { String::new() } else { format!("# robot {} {}\n", robot.name, robot.content()) };
    output::print(&format!("# seed {}\n{content}{}", args.settings.seed, pipeline.to_toml(args.stage)?))?;
    Ok(Outcome::Done)
}
