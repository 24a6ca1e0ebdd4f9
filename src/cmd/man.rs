use super::places::{Content, Places};
use super::{Context, Outcome};
use crate::data::{atomic, marked};
use crate::error::{Error, Result};
use clap::Command;
use clap_mangen::Man;
use std::path::PathBuf;

/// Write a manual page for hilt and for each of its commands: hilt.1, hilt-plan.1, ...
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt man man1")]
pub struct Args {
    /// Directory of manual pages; those of others in it stay
    #[arg(value_name = "DIR")]
    dir: PathBuf,
}

pub fn run(args: &Args, mut command: Command, context: &Context) -> Result<Outcome> {
    command.build();
    let named: Vec<(PathBuf, Vec<u8>)> =
        pages(&command)?.into_iter().map(|(name, page)| (args.dir.join(format!("{name}.1")), page)).collect();
    let places = named.iter().fold(Places::new(), |places, (path, _)| places.write("the manual page", path, Content::Man));
    places.check(&context.console)?;
    std::fs::create_dir_all(&args.dir).map_err(|e| Error::io(&args.dir, "create", e))?;
    atomic::write_all(&named)?;
    context.console.say(&format!("man: wrote {} pages to {}", named.len(), args.dir.display()));
    Ok(Outcome::Done)
}

/// The page of a command, and of each below it.
fn pages(command: &Command) -> Result<Vec<(String, Vec<u8>)>> {
    let (name, mut page) = (command.get_display_name().unwrap_or(command.get_name()).to_string(), Vec::new());
    let man = Man::new(command.clone());
    man.render(&mut page).map_err(|e| Error::Failed(format!("the page of {name} cannot be written: {e}")))?;
    let mut all = vec![(name, marked::man(&page))];
    for below in command.get_subcommands().filter(|below| below.get_name() != "help") {
        all.extend(pages(below)?);
    }
    Ok(all)
}
