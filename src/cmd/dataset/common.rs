//! What the subcommands that write share.

use crate::cmd::places::{Content, Places};
use crate::cmd::{Context, Outcome};
use crate::data::dataset::edit::{self, Input, Part, Plan};
use crate::data::dataset::{TRAIN, VALIDATION};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// One dataset to read, one to write.
#[derive(Debug, clap::Args)]
pub struct Ends {
    /// A LeRobotDataset v3.0
    #[arg(value_name = "DIR")]
    pub dataset: PathBuf,
    /// Directory to write
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

impl Ends {
    /// The dataset, when the places are checked.
    ///
    /// # Errors
    /// As [`check_places`] and [`open`].
    pub fn open(&self, context: &Context) -> Result<Input> {
        check_places(std::slice::from_ref(&self.dataset), &self.out, context)?;
        open(&self.dataset)
    }
}

/// The roots in a directory: itself, or its datasets train and validation.
pub fn roots(dir: &Path) -> Vec<PathBuf> {
    let pair: Vec<PathBuf> =
        [TRAIN, VALIDATION].map(|name| dir.join(name)).into_iter().filter(|root| root.join("meta").is_dir()).collect();
    if dir.join("meta").is_dir() || pair.is_empty() { vec![dir.into()] } else { pair }
}

/// One dataset, not the pair of them.
///
/// # Errors
/// What is wrong with it.
pub fn open(dir: &Path) -> Result<Input> {
    if let [one, other] = &roots(dir)[..] {
        let message = format!("holds the two datasets {} and {}; name one of them", one.display(), other.display());
        return Err(Error::input(dir, message));
    }
    Input::open(dir)
}

/// Checks the places of a command that makes one dataset.
///
/// # Errors
/// As [`Places::check`].
pub fn check_places(inputs: &[PathBuf], out: &Path, context: &Context) -> Result<()> {
    let places = Places::new().read_all(inputs.iter().map(PathBuf::as_path));
    places.write("--out", out, Content::Dataset).check(&context.console)
}

/// Writes the episodes that `takes` has of the one input, and says how many.
///
/// # Errors
/// As [`edit::write`]; [`Error::Failed`] when no episode is left.
pub fn write(out: &Path, input: Input, plan: &Plan, takes: Vec<bool>, context: &Context) -> Result<Outcome> {
    let (kept, all) = (takes.iter().filter(|takes| **takes).count(), takes.len());
    if kept == 0 {
        return Err(Error::Failed(format!("none of {all} episodes is left; nothing was written")));
    }
    let parts = [Part { folder: "", takes: vec![takes] }];
    edit::write(out, &[input], plan, &parts, &context.interrupt)?;
    context.console.say(&format!("dataset: wrote {}: {kept} of {all} episodes", out.display()));
    Ok(Outcome::Done)
}

/// Episodes by their numbers; what is named must be there.
///
/// # Errors
/// [`Error::Usage`] for what is no list, and for an episode that is not there.
pub fn named(flag: &str, text: &str, input: &Input) -> Result<Vec<bool>> {
    let found = edit::episodes_of(text).map_err(|why| Error::Usage(format!("{flag} {why}")))?;
    let count = input.episodes();
    match found.last() {
        Some(last) if *last >= count => {
            Err(Error::Usage(format!("{flag} names episode {last}, but there are {count}: 0 to {}", count - 1)))
        }
        _ => Ok((0..count).map(|number| found.contains(&number)).collect()),
    }
}
