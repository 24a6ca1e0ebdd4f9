use super::places::Places;
use super::{Context, Outcome, output};
use crate::error::{Error, Result};
use crate::learn::MethodName;
use crate::report::compare::{Evaluated, by_seeds, compare, find};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Hold two evaluations against each other: by episode where both were tried on the same ones, by seed where there are several.
///
/// Episodes are pairs where task, seed and start are the same: then McNemar's exact test and Newcombe's interval for pairs tell the policies apart, and
/// every episode that ended otherwise is named. Two directories with several seeds each are paired by seed.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt compare evaluation.json evaluation-bc.json")]
pub struct Args {
    /// Run, evaluation.json, table of its episodes, or a directory of runs; :hil or another method after a directory picks that
    #[arg(value_name = "RUN|FILE|DIR[:METHOD]")]
    first: PathBuf,
    /// The other one [default: the second method of a run that has two]
    #[arg(value_name = "RUN|FILE|DIR[:METHOD]")]
    second: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let (first, method) = picked(&args.first)?;
    let second = args.second.as_deref().map(picked).transpose()?;
    let others = second.as_ref().map(|(path, _)| path.as_path());
    Places::new().read(&first).read_all(others).check(&context.console)?;
    let mut ours = evaluations(&first, method.as_deref(), context)?;
    let theirs = match &second {
        Some((path, method)) => evaluations(path, method.as_deref(), context)?,
        None if ours.len() == 2 => vec![ours.remove(1)],
        None => {
            let (n, path) = (ours.len(), first.display());
            return Err(Error::Usage(format!(
                "{path}: has {n} evaluations; name the one to compare with, or a run that has two"
            )));
        }
    };
    let width = output::width();
    if let ([one], [other]) = (ours.as_slice(), theirs.as_slice()) {
        let found = compare(one, other);
        if args.json {
            output::print_json(&found.to_json())?
        } else {
            output::print(&found.to_text(width))?
        }
        return Ok(Outcome::Done);
    }
    let found = by_seeds(&ours, &theirs).map_err(|why| Error::input(&first, why))?;
    let names = [&args.first, args.second.as_ref().unwrap_or(&args.first)].map(|path| path.display().to_string());
    if args.json {
        output::print_json(&found.to_json())?;
    } else {
        output::print(&found.to_text([&names[0], &names[1]], width))?;
    }
    Ok(Outcome::Done)
}

/// A path, and the method behind its last colon, where the path as it is does not exist.
fn picked(said: &Path) -> Result<(PathBuf, Option<String>)> {
    let split = said.to_str().and_then(|said| said.rsplit_once(':')).filter(|_| !said.exists());
    let Some((path, method)) = split else { return Ok((said.into(), None)) };
    if method != "planner" {
        MethodName::from_str(method).map_err(|why| Error::Usage(format!("{}: {why}", said.display())))?;
    }
    Ok((path.into(), Some(method.into())))
}

fn evaluations(path: &Path, method: Option<&str>, context: &Context) -> Result<Vec<Evaluated>> {
    let mut found = find(path, &context.interrupt)?;
    if let Some(method) = method {
        let all: Vec<String> = found.iter().map(|evaluated| evaluated.name.clone()).collect();
        found.retain(|evaluated| evaluated.method.as_deref() == Some(method));
        if found.is_empty() {
            return Err(Error::input(path, format!("has no evaluation of {method}; there are: {}", all.join(", "))));
        }
    }
    Ok(found)
}
