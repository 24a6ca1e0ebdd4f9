//! What `hilt view`, `hilt render --html` and `hilt evaluate --render` share: from recordings to the page.

use super::fits::{of_recording, read_network};
use super::places::{Content, Places};
use super::pretrain;
use super::{Console, Context};
use crate::config::Pipeline;
use crate::data::{Provenance, atomic, recording};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::experiment::seeds_of;
use crate::learn::Dynamics;
use crate::report::view::{Atlas, Ghost, Shown, Start, names, page};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Episodes of a page unless they are chosen, and how many may be: each is some tens of kilobytes.
const USUAL_EPISODES: usize = 12;
const MOST_EPISODES: usize = 64;
/// The directory of a run that holds its recordings.
const RECORDINGS: &str = "recordings";

/// What is shown, and how.
#[derive(Debug, Default, clap::Args)]
pub struct PageArgs {
    /// Of each directory, only these episodes (0-3,9); of several directories the same, to compare [default: the first ones]
    #[arg(long, value_name = "NUMBERS")]
    episodes: Option<String>,
    /// Add a failure atlas of one directory: how all its episodes end, where they start, and of each way to end the first N to play
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16), conflicts_with = "episodes")]
    atlas: Option<u32>,
    /// Show as a ghost what this dynamics network expected: open loop from the recorded state --ahead steps before, with the executed commands
    #[arg(long, value_name = "FILE.safetensors")]
    dynamics: Option<PathBuf>,
    /// Steps, of 50 ms, that the ghost is predicted ahead; 1 for one-step predictions
    #[arg(long, value_name = "STEPS", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    ahead: u32,
}

impl PageArgs {
    /// Whether any of them is asked for.
    pub fn given(&self) -> bool {
        self.episodes.is_some() || self.atlas.is_some() || self.dynamics.is_some()
    }
}

/// Where recordings are: a file, or a directory with its files.
#[derive(Debug)]
struct Source {
    /// The file, or the directory of recordings.
    place: PathBuf,
    files: Option<Vec<PathBuf>>,
}

impl Source {
    /// A recording, a directory of recordings, or that of a run, which has one.
    ///
    /// # Errors
    /// [`Error::Input`] for a directory without recordings; what reading it returns.
    fn find(path: &Path) -> Result<Self> {
        if !path.is_dir() {
            return Ok(Source { place: path.into(), files: None });
        }
        for place in [path.to_path_buf(), path.join(RECORDINGS)].into_iter().filter(|place| place.is_dir()) {
            let files = recording::files(&place)?;
            if !files.is_empty() {
                return Ok(Source { place, files: Some(files) });
            }
        }
        Err(Error::input(
            path,
            "holds no recordings (episode-00000.mcap, ...), nor does a directory recordings in it; hilt simulate and hilt evaluate --record make some",
        ))
    }

    /// The files that are asked for.
    fn chosen(&self, wanted: Option<&[u64]>, most: usize, console: &Console) -> Result<Vec<PathBuf>> {
        let Some(files) = &self.files else { return Ok(vec![self.place.clone()]) };
        let Some(wanted) = wanted else {
            if files.len() > most {
                let (place, all) = (self.place.display(), files.len());
                console.say(&format!("{place}: shows the first {most} of {all} episodes; --episodes 0-3,9 chooses others"));
            }
            return Ok(files.iter().take(most).cloned().collect());
        };
        let one = |number: &u64| {
            let file = self.place.join(recording::file_name(*number));
            let missing = || format!("has no {}; it has {} recordings", recording::file_name(*number), files.len());
            if files.contains(&file) { Ok(file) } else { Err(Error::input(&self.place, missing())) }
        };
        wanted.iter().map(one).collect()
    }
}

/// Names of so many inputs are a title; more are counted.
const MOST_NAMED: usize = 4;

/// A title for what is shown: the names of the inputs.
pub fn title_of(inputs: &[PathBuf]) -> String {
    let name = |input: &PathBuf| {
        let whole = std::path::absolute(input).ok();
        whole.as_deref().and_then(Path::file_stem).map_or("hilt".into(), |name| name.to_string_lossy().into_owned())
    };
    match inputs.len() {
        ..=MOST_NAMED => inputs.iter().map(name).collect::<Vec<_>>().join(", "),
        several => format!("{several} inputs"),
    }
}

/// Writes the page of these recordings, directories of them and runs; returns where it is: in the working directory unless `out` says.
///
/// # Errors
/// [`Error::Usage`] for numbers that are none or too many; what reading a recording or the network returns, and [`Places::check`].
pub fn write(inputs: &[PathBuf], args: &PageArgs, out: Option<&Path>, context: &Context) -> Result<PathBuf> {
    let sources = inputs.iter().map(|input| Source::find(input)).collect::<Result<Vec<_>>>()?;
    let out = out.map_or_else(|| PathBuf::from(format!("{}.html", title_of(&inputs[..1]))), Path::to_path_buf);
    let places = Places::new().read_all(sources.iter().map(|source| source.place.as_path())).read_all(args.dynamics.as_deref());
    places.write("--out", &out, Content::Page).check(&context.console)?;
    let page = make(&title_of(inputs), &sources, args, context)?;
    atomic::write_bytes(&out, page.as_bytes())?;
    Ok(out)
}

fn make(title: &str, sources: &[Source], args: &PageArgs, context: &Context) -> Result<String> {
    if let Some(most) = args.atlas {
        let [Source { place, files: Some(_) }] = sources else {
            return Err(Error::Usage("--atlas: an atlas is of one directory of recordings; give one".into()));
        };
        return atlas(title, place, most as usize, args, context);
    }
    let wanted = args.episodes.as_deref().map(seeds_of).transpose();
    let wanted = wanted.map_err(|why| Error::Usage(format!("--episodes: {}", why.replace("seed", "episode"))))?;
    let directories = sources.iter().filter(|source| source.files.is_some()).count();
    let most = (USUAL_EPISODES / directories.max(1)).max(1);
    let chosen = sources.iter().map(|source| source.chosen(wanted.as_deref(), most, &context.console));
    let files: Vec<PathBuf> = chosen.collect::<Result<Vec<_>>>()?.concat();
    if files.len() > MOST_EPISODES {
        return Err(Error::Usage(format!("{} episodes are asked for; a page shows at most {MOST_EPISODES}", files.len())));
    }
    let shown = read(&files, args, context)?;
    page(title, &shown, None)
}

/// The page of a directory with its atlas.
///
/// # Errors
/// [`Error::Input`] for recordings of several tasks; what reading them returns.
pub fn atlas(title: &str, dir: &Path, most: usize, args: &PageArgs, context: &Context) -> Result<String> {
    let files = recording::files(dir)?;
    let one = |file: &PathBuf| {
        context.interrupt.check()?;
        let (episode, _) = recording::read(file)?;
        Ok((Start::of(&episode), episode.scene.task))
    };
    let found = files.par_iter().map(one).collect::<Vec<Result<_>>>().into_iter().collect::<Result<Vec<_>>>()?;
    let (starts, tasks): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    let Some(task) = tasks.first().cloned() else { return Err(Error::input(dir, "holds no recordings")) };
    if let Some(i) = tasks.iter().position(|other| *other != task) {
        let (file, other) = (files[i].file_name().unwrap_or_default().display(), &tasks[i]);
        return Err(Error::input(
            dir,
            format!("{file} in it is of task {other}, those before are of {task}; an atlas is of one task"),
        ));
    }
    let atlas = Atlas { task, starts };
    let chosen: Vec<PathBuf> = atlas.chosen(most).into_iter().map(|i| files[i].clone()).collect();
    page(title, &read(&chosen, args, context)?, Some(&atlas))
}

/// Episodes with their names, and with their ghosts.
fn read(files: &[PathBuf], args: &PageArgs, context: &Context) -> Result<Vec<Shown>> {
    let names = names(&files.iter().map(PathBuf::as_path).collect::<Vec<_>>());
    let one = |(file, name): (&PathBuf, &String)| {
        context.interrupt.check()?;
        let (episode, provenance) = recording::read(file)?;
        let ghost = args.dynamics.as_deref().map(|network| expected(network, &episode, args.ahead as usize)).transpose()?;
        Ok(Shown { name: name.clone(), about: about(&episode, &provenance), episode, ghost })
    };
    // Of several that cannot be read the first is told, whatever the threads.
    files.par_iter().zip(&names).map(one).collect::<Vec<Result<_>>>().into_iter().collect()
}

/// By the network of the episode's robot and task.
fn expected(network: &Path, episode: &Episode, ahead: usize) -> Result<Ghost> {
    let mut pipeline = Pipeline::defaults(&episode.scene.task);
    pipeline.robot = episode.scene.robot.clone().into();
    of_recording(network, pretrain::KIND, &episode.scene)?;
    let (dynamics, ..) = read_network(network, pretrain::KIND, &pipeline, Dynamics::from_tensors, |network| network.layout())?;
    Ok(Ghost::new(episode, &dynamics, ahead))
}

/// Robot and task, and who acted.
fn about(episode: &Episode, made: &Provenance) -> String {
    let scene = &episode.scene;
    format!("{} \u{b7} {} \u{b7} {}", scene.task.name, scene.robot.name, who(made))
}

/// Who acted, as far as the recording says.
pub fn who(made: &Provenance) -> String {
    let policy = &made.settings["policy"];
    let served = policy["address"].as_str().map(|address| format!("policy at {address}"));
    let named = policy.as_str().map(String::from).or(served);
    match (made.stage.as_str(), named) {
        ("simulate", _) => "demonstration".into(),
        (_, Some(named)) => named,
        (stage, None) => stage.into(),
    }
}
