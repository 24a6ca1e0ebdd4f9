use super::common::{SettingsArgs, path_or};
use super::fits::{same_robot, same_task};
use super::places::Content;
use super::{Console, Context, Outcome, Progress, dropped};
use crate::config::{Pipeline, Stage};
use crate::data::dataset::{self, DatasetEpisode, Episodes, Fingerprint};
use crate::data::origin::Kind;
use crate::data::{ContentHash, recording};
use crate::demo::Episode;
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Turn recordings into two LeRobot datasets, train and validation. Failed episodes are dropped, counted and named.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt convert --recordings recordings --out dataset")]
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

/// Demos are kept from the first reading up to so many bytes of their numbers, some 1,500 pick-ups; the others are read a second time, so
/// that memory does not grow with the number of recordings.
const HELD_BYTES: usize = 24 << 20;

/// What is kept of a recording that was read.
struct Found {
    path: PathBuf,
    /// Its number by its file's name: unique also where the recordings of several runs were put together.
    number: u64,
    seed: u64,
    steps: usize,
    /// Of its bytes.
    hash: ContentHash,
    fingerprint: Fingerprint,
    /// What the dataset takes of it, if there was room.
    held: Option<DatasetEpisode>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve_from(args.recordings.as_deref().map(|dir| (dir, Kind::Recordings)), &[])?;
    let dir = path_or(args.recordings.as_deref(), &pipeline, "recordings");
    let out = path_or(args.out.as_deref(), &pipeline, "dataset");
    args.settings
        .places(&context.console)
        .read(&dir)
        .write("--out", &out, Content::Datasets("convert"))
        .check(&context.console)?;
    let files = recording::files(&dir)?;
    if files.is_empty() {
        return Err(Error::input(&dir, "holds no recording (episode-00000.mcap, ...); run `hilt simulate` first"));
    }

    say_of_gaps(&files, &context.console);

    let progress = context.console.progress("convert", files.len() as u64, "recordings");
    let room = Room(AtomicUsize::new(HELD_BYTES));
    let read: Vec<Result<(ContentHash, dropped::Kept<_>)>> = files
        .par_iter()
        .map(|path| {
            context.interrupt.check()?;
            let found = find(path, &pipeline, &room);
            progress.step();
            found
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
    let again = kept.iter().filter(|found| found.held.is_none()).count() as u64;
    let progress = (again > 0).then(|| context.console.progress("convert", again, "recordings read again"));
    let pick = |positions: &[usize]| {
        let picked: Vec<&Found> = positions.iter().map(|at| &kept[*at]).collect();
        let steps = picked.iter().map(|found| found.steps).collect();
        let progress = progress.as_ref();
        Episodes::new(steps, move |at| picked[at].episode(progress))
    };
    let names = files.iter().filter_map(|path| path.file_name()?.to_str());
    let content = ContentHash::of_directory(names.zip(hashes));
    let provenance = args.settings.provenance(Stage::Convert, &pipeline, &[("recordings", content)])?;
    dataset::write_split(
        &out,
        (&pipeline.robot, &pipeline.task),
        &pick(&train),
        &pick(&validation),
        &provenance,
        &context.interrupt,
    )?;
    progress.into_iter().for_each(|progress| progress.finish(""));
    let (to, t, v) = (out.display(), train.len(), validation.len());
    context.console.say(&format!("convert: wrote {to}: {t} training and {v} validation episodes"));
    Ok(outcome)
}

/// Numbers of recordings that are named at most.
const MOST_NAMED: usize = 5;

/// Says which numbers have no recording: it was dropped when it was made, or it was lost since.
fn say_of_gaps(files: &[PathBuf], console: &Console) {
    let numbers: BTreeSet<u64> = files.iter().filter_map(|path| recording::number_of(path.file_name()?.to_str()?)).collect();
    let Some(last) = numbers.last() else { return };
    let lacking = last - (numbers.len() as u64 - 1);
    if lacking > 0 {
        let first: Vec<String> = (0..*last).filter(|n| !numbers.contains(n)).take(MOST_NAMED).map(|n| n.to_string()).collect();
        let more = if lacking > first.len() as u64 { ", ..." } else { "" };
        console.say(&format!("convert: up to episode {last} there are {lacking} recordings missing: {}{more}", first.join(", ")));
    }
}

/// Memory that may still be taken \[bytes\].
struct Room(AtomicUsize);

impl Room {
    /// Whether so much could be taken.
    fn take(&self, bytes: usize) -> bool {
        self.0.try_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(bytes)).is_ok()
    }
}

/// The hash of a recording's bytes, and what is kept of it; a failed episode is dropped.
fn find(path: &Path, pipeline: &Pipeline, room: &Room) -> Result<(ContentHash, dropped::Kept<Found>)> {
    let (episode, made, hash) = recording::read_hashed(path)?;
    same_task(path, &made, pipeline)?;
    same_robot(path, &made, pipeline)?;
    let number = path.file_name().and_then(|name| recording::number_of(name.to_str()?)).unwrap_or(episode.index);
    if let Some(class) = episode.failure.filter(|_| !pipeline.convert.keep_failed) {
        return Ok((hash, Err(format!("episode {number} failed, {}: {}", class.name(), class.words()))));
    }
    let taken = taken(path, &episode, number)?;
    let (steps, fingerprint) = (taken.demo.len(), Fingerprint::of(&taken.demo));
    let held = room.take(taken.bytes()).then_some(taken);
    Ok((hash, Ok(Found { path: path.to_path_buf(), number, seed: made.seed, steps, hash, fingerprint, held })))
}

/// What the dataset takes of an episode.
fn taken(path: &Path, episode: &Episode, number: u64) -> Result<DatasetEpisode> {
    let demo = episode.to_demo().map_err(|why| Error::input(path, why))?;
    Ok(DatasetEpisode { source_index: number, ..DatasetEpisode::of(episode, demo) })
}

impl Found {
    /// What the dataset takes of it, held or read again.
    fn episode(&self, progress: Option<&Progress>) -> Result<Cow<'_, DatasetEpisode>> {
        if let Some(held) = &self.held {
            return Ok(Cow::Borrowed(held));
        }
        let (episode, _, hash) = recording::read_hashed(&self.path)?;
        if hash != self.hash {
            return Err(Error::input(&self.path, "changed while hilt convert was reading it; run hilt convert again"));
        }
        progress.into_iter().for_each(Progress::step);
        taken(&self.path, &episode, self.number).map(Cow::Owned)
    }
}

/// The same episode twice would stand in training and validation, or count twice.
fn refuse_twins(dir: &Path, found: &[Found]) -> Result<()> {
    let Some((one, other)) = dataset::first_twins(found.iter().map(|f| f.fingerprint)) else { return Ok(()) };
    let [one, other] = [one, other].map(|at| recording::file_name(found[at].number));
    let message =
        format!("is the same episode as {one}, in every number: both could land in training and validation; remove one of them");
    Err(Error::input(&dir.join(other), message))
}

/// Says so when the recordings are of several runs.
fn say_of_runs(found: &[Found], console: &Console) {
    let seeds: BTreeSet<u64> = found.iter().map(|f| f.seed).collect();
    if seeds.len() > 1 {
        let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
        console.say(&format!(
            "convert: the recordings are of several runs, seeds {}; episodes go by their files' numbers",
            seeds.join(", ")
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_that_is_replaced_between_its_two_readings_is_named() {
        let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/pick-up/recordings/episode-00000.mcap");
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("episode-00007.mcap");
        std::fs::copy(fixture, &path).expect("copied");
        let mut pipeline = Pipeline::defaults(&crate::task::built_in::pick_up());
        pipeline.convert.keep_failed = true;
        let found = |bytes: usize| find(&path, &pipeline, &Room(AtomicUsize::new(bytes))).expect("a recording").1;
        let (held, again) = (found(HELD_BYTES).expect("kept"), found(0).expect("kept"));
        assert!(held.held.is_some() && again.held.is_none());
        let [one, other] = [&held, &again].map(|found| found.episode(None).expect("an episode"));
        assert_eq!((&one.demo, &one.rewards, one.source_index), (&other.demo, &other.rewards, 7));

        let (mut episode, made) = recording::read(&path).expect("a recording");
        episode.steps[0].commanded[0] += 0.1;
        recording::write(&path, &episode, &made).expect("written");
        let said = again.episode(None).expect_err("refused").to_string();
        assert!(said.contains("episode-00007.mcap: changed while"), "{said}");
        assert!(held.episode(None).is_ok(), "what is held is not read again");
    }
}
