use super::common::{SettingsArgs, path_or, same_task};
use super::{Context, Outcome, dropped};
use crate::config::Stage;
use crate::data::{dataset, recording};
use crate::demo::{Demo, Episode};
use crate::error::{Error, Result};
use crate::tasks::Task;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Turn recordings into two LeRobot datasets, train and validation. Failed episodes are dropped, counted and named.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Directory of recordings [default: runs/<TASK>/recordings]
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Directory to write, with train and validation in it [default: runs/<TASK>/dataset]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// For when no episode succeeded.
const ADVICE: &str = "record again with less noise (simulate.noise_variance), or keep them with convert.keep_failed=true";

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve(&[])?;
    let dir = path_or(args.recordings.as_deref(), pipeline.task, "recordings");
    let out = path_or(args.out.as_deref(), pipeline.task, "dataset");
    let files = recordings(&dir)?;

    let progress = context.console.progress("convert", files.len() as u64, "recordings");
    let read: Vec<dropped::Kept<_>> = files
        .par_iter()
        .map(|path| {
            context.interrupt.check()?;
            let loaded = load(path, pipeline.task, pipeline.convert.keep_failed);
            progress.step();
            loaded
        })
        .collect::<Result<_>>()?;
    progress.finish("");
    let (mut kept, outcome) = dropped::keep("convert", read, ADVICE, &context.console)?;
    let wanted = pipeline.convert.demos as usize;
    if kept.len() < wanted {
        let all = format!("{} demos where {wanted} are wanted at most (convert.demos)", kept.len());
        context.console.say(&format!("convert: {all}: takes all of them; raise plan.episodes for more"));
    } else if wanted > 0 {
        kept.truncate(wanted);
    }

    let (train, validation) = dataset::split(kept.len(), pipeline.convert.train_per_validation, args.settings.seed);
    let pick =
        |indices: &[usize]| -> Vec<_> { indices.iter().map(|i| dataset::DatasetEpisode::of(&kept[*i].0, &kept[*i].1)).collect() };
    let provenance = args.settings.provenance(Stage::Convert, &pipeline, &[("recordings", &dir)])?;
    dataset::write_split(&out, pipeline.task, &pick(&train), &pick(&validation), &provenance, &context.interrupt)?;
    let (to, t, v) = (out.display(), train.len(), validation.len());
    context.console.say(&format!("convert: wrote {to}: {t} training and {v} validation episodes"));
    Ok(outcome)
}

/// The recordings of a directory, by episode.
fn recordings(dir: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(dir).map_err(|e| Error::io(dir, "read", e))?;
    let names = entries.map(|entry| entry.map(|e| e.file_name())).collect::<std::io::Result<Vec<_>>>();
    let names = names.map_err(|e| Error::io(dir, "read", e))?;
    let mut files: Vec<PathBuf> =
        names.iter().filter(|n| n.to_str().is_some_and(recording::is_file_name)).map(|n| dir.join(n)).collect();
    files.sort();
    if files.is_empty() {
        return Err(Error::input(dir, "holds no recording (episode-00000.mcap, ...); run `hilt simulate` first"));
    }
    Ok(files)
}

fn load(path: &Path, task: Task, keep_failed: bool) -> Result<dropped::Kept<(Episode, Demo)>> {
    let (episode, _) = recording::read(path)?;
    same_task(path, episode.scene.task, task)?;
    match episode.failure {
        Some(class) if !keep_failed => Ok(Err(format!("episode {} failed, {}: {}", episode.index, class.name(), class.words()))),
        _ => {
            let demo = episode.to_demo().map_err(|why| Error::input(path, why))?;
            Ok(Ok((episode, demo)))
        }
    }
}
