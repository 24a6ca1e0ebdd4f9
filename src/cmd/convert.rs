use super::common::{SettingsArgs, path_or, same_task};
use super::places::Content;
use super::{Console, Context, Outcome, dropped};
use crate::config::Stage;
use crate::data::{ContentHash, dataset, recording};
use crate::demo::{Demo, Episode};
use crate::error::{Error, Result};
use crate::tasks::Task;
use rayon::prelude::*;
use std::collections::BTreeSet;
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

/// A recording that was read.
struct Loaded {
    /// Its number by its file's name: unique also where the recordings of several runs were put together.
    number: u64,
    episode: Episode,
    demo: Demo,
    seed: u64,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve(&[])?;
    let dir = path_or(args.recordings.as_deref(), pipeline.task, "recordings");
    let out = path_or(args.out.as_deref(), pipeline.task, "dataset");
    args.settings.places().read(&dir).write("--out", &out, Content::Datasets).check(&context.console)?;
    let files = recording::files(&dir)?;
    if files.is_empty() {
        return Err(Error::input(&dir, "holds no recording (episode-00000.mcap, ...); run `hilt simulate` first"));
    }

    let progress = context.console.progress("convert", files.len() as u64, "recordings");
    let read: Vec<Result<(ContentHash, dropped::Kept<_>)>> = files
        .par_iter()
        .map(|path| {
            context.interrupt.check()?;
            let loaded = load(path, pipeline.task, pipeline.convert.keep_failed);
            progress.step();
            loaded
        })
        .collect();
    // One after the other: of several that cannot be used the first by name is told, whatever the threads.
    let (hashes, read): (Vec<_>, Vec<_>) = read.into_iter().collect::<Result<Vec<_>>>()?.into_iter().unzip();
    progress.finish("");
    let (mut kept, outcome) = dropped::keep("convert", read, ADVICE, &context.console)?;
    refuse_twins(&dir, &kept)?;
    say_of_runs(&kept, &context.console);
    let wanted = pipeline.convert.demos as usize;
    if kept.len() < wanted {
        let all = format!("{} demos where {wanted} are wanted at most (convert.demos)", kept.len());
        context.console.say(&format!("convert: {all}: takes all of them; raise plan.episodes for more"));
    } else if wanted > 0 {
        kept.truncate(wanted);
    }

    let (train, validation) = dataset::split(kept.len(), pipeline.convert.train_per_validation, args.settings.seed);
    let pick = |indices: &[usize]| -> Vec<_> { indices.iter().map(|i| kept[*i].for_dataset()).collect() };
    let names = files.iter().filter_map(|path| path.file_name()?.to_str());
    let content = ContentHash::of_directory(names.zip(hashes));
    let provenance = args.settings.provenance(Stage::Convert, &pipeline, &[("recordings", content)])?;
    dataset::write_split(&out, pipeline.task, &pick(&train), &pick(&validation), &provenance, &context.interrupt)?;
    let (to, t, v) = (out.display(), train.len(), validation.len());
    context.console.say(&format!("convert: wrote {to}: {t} training and {v} validation episodes"));
    Ok(outcome)
}

/// A recording, and the hash of its bytes; a failed episode is dropped.
fn load(path: &Path, task: Task, keep_failed: bool) -> Result<(ContentHash, dropped::Kept<Loaded>)> {
    let (episode, made, hash) = recording::read_hashed(path)?;
    same_task(path, episode.scene.task, task)?;
    let number = path.file_name().and_then(|name| recording::number_of(name.to_str()?)).unwrap_or(episode.index);
    let kept = match episode.failure {
        Some(class) if !keep_failed => Err(format!("episode {number} failed, {}: {}", class.name(), class.words())),
        _ => {
            let demo = episode.to_demo().map_err(|why| Error::input(path, why))?;
            Ok(Loaded { number, episode, demo, seed: made.seed })
        }
    };
    Ok((hash, kept))
}

impl Loaded {
    fn for_dataset(&self) -> dataset::DatasetEpisode<'_> {
        dataset::DatasetEpisode { source_index: self.number, ..dataset::DatasetEpisode::of(&self.episode, &self.demo) }
    }
}

/// The same episode twice would stand in training and validation, or count twice.
fn refuse_twins(dir: &Path, loaded: &[Loaded]) -> Result<()> {
    let Some((one, other)) = dataset::first_twins(loaded.iter().map(|l| &l.demo)) else { return Ok(()) };
    let [one, other] = [one, other].map(|at| recording::file_name(loaded[at].number));
    let message =
        format!("is the same episode as {one}, in every number: both could land in training and validation; remove one of them");
    Err(Error::input(&dir.join(other), message))
}

/// Says so when the recordings are of several runs.
fn say_of_runs(loaded: &[Loaded], console: &Console) {
    let seeds: BTreeSet<u64> = loaded.iter().map(|l| l.seed).collect();
    if seeds.len() > 1 {
        let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
        console.say(&format!(
            "convert: the recordings are of several runs, seeds {}; episodes go by their files' numbers",
            seeds.join(", ")
        ));
    }
}
