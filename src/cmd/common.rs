//! The flags that all stages share: which settings, which seed.

use super::made_for::MadeFor;
use super::places::Places;
use crate::config::{self, ChosenTask, LearningSettings, Pipeline, Preset, Source, Stage};
use crate::data::origin::Kind;
use crate::data::{ContentHash, Provenance, weights};
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::plan::check_ready_pose;
use crate::task::built_in;
use crate::tasks::with_layout;
use crate::tensor::NamedTensor;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Where artefacts go unless a flag says otherwise.
pub const RUNS: &str = "runs";

/// Which settings: a preset of a task or a pipeline file, then `--set`, then flags of the stage.
#[derive(Debug, clap::Args)]
pub struct SettingsArgs {
    /// Task: pick-up, pick-and-place, stack, or the TOML file of another [default: that of the artefact that is read]
    #[arg(long, value_name = "NAME|FILE.toml")]
    task: Option<String>,
    /// Robot: jaco, panda, ur5e, or the TOML file of another [default: that of the artefact or the pipeline, jaco]
    #[arg(long, value_name = "NAME|FILE.toml")]
    robot: Option<String>,
    /// Pipeline file with the settings of every stage [default: the one of the task that comes with hilt]
    #[arg(long, value_name = "FILE")]
    pipeline: Option<PathBuf>,
    /// Settings that come with hilt: best (every documented mend), paper (as literal as can work) or mended (paper
    /// with the mends that lift hil above bc) [default: best]
    #[arg(long, value_name = "PRESET", conflicts_with = "pipeline")]
    preset: Option<Preset>,
    /// Override one setting, in TOML; may be repeated (--set plan.speed=0.5 --set scene.yaw=true)
    #[arg(long, value_name = "STAGE.KEY=VALUE")]
    set: Vec<String>,
    /// Overrides in one text, separated by blanks; a blank inside brackets or quotes belongs to the value (SET=... of make)
    #[arg(long, value_name = "TEXT")]
    sets: Option<String>,
    /// Seed of every random number
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
}

/// The key of a provenance's settings that says that what was learned from is a dataset of another program, and which columns.
pub const FOREIGN: &str = "columns";

/// A flag that stands for one setting.
pub type Flag<'a> = (&'a str, Option<String>);

impl SettingsArgs {
    /// What these settings are read from, where that is a file.
    pub fn places(&self) -> Places {
        let said = [self.robot.as_deref(), self.task.as_deref()].into_iter().flatten().map(Path::new);
        Places::new().read_all(self.pipeline.as_deref().into_iter().chain(said.filter(|path| path.is_file())))
    }

    /// The resolved settings; `flags` are dotted keys with the values of the stage's own flags, where given.
    ///
    /// # Errors
    /// [`Error::Usage`] when neither task nor pipeline file is given; see [`Pipeline::load`].
    pub fn resolve(&self, flags: &[Flag]) -> Result<Pipeline> {
        self.resolve_from(None, flags)
    }

    /// As [`SettingsArgs::resolve`]; where neither task nor pipeline file is given, task and robot are those that an artefact was made for.
    ///
    /// # Errors
    /// Also what reading the artefact returns.
    pub fn resolve_from(&self, artefact: Option<(&Path, Kind)>, flags: &[Flag]) -> Result<Pipeline> {
        let unsaid = self.task.is_none() && self.pipeline.is_none();
        let made_for = artefact.filter(|_| unsaid).map(|(path, kind)| MadeFor::read(path, kind)).transpose()?;
        let robot = self.robot.clone().or_else(|| made_for.as_ref()?.robot.clone());
        let source = match (&self.pipeline, self.task.as_deref().or(made_for.as_ref().map(|made| made.task.as_str()))) {
            (Some(path), said) => Source::File(path.clone(), said.map(task_said).transpose()?),
            // A task's file is a pipeline file.
            (None, Some(said)) if self.preset.is_none() && config::is_file(said) => Source::File(said.into(), None),
            (None, Some(said)) => Source::BuiltIn(task_said(said)?, self.preset.unwrap_or_default()),
            (None, None) => {
                let tasks = built_in::names().join(", ");
                return Err(Error::Usage(format!("which task? give --task ({tasks}, or a file) or --pipeline FILE")));
            }
        };
        let (sets, given) = self.overrides([&("robot", robot)].into_iter().chain(flags));
        let pipeline = Pipeline::load(&source, &sets).map_err(|e| in_words_of_flags(e, &given))?;
        check_ready_pose(&pipeline.robot, &pipeline.scene)?;
        Ok(pipeline)
    }

    /// The task that is given, if one is.
    ///
    /// # Errors
    /// [`Error::Usage`] when there is none of this name.
    pub fn task(&self) -> Result<Option<ChosenTask>> {
        self.task.as_deref().map(task_said).transpose()
    }

    /// The settings of learning from a dataset of another program in `dir`.
    ///
    /// # Errors
    /// [`Error::Usage`] with a task or a robot; see [`LearningSettings::load`].
    pub fn resolve_for_dataset(&self, dir: &Path, flags: &[Flag]) -> Result<LearningSettings> {
        for (flag, said) in [("--task", &self.task), ("--robot", &self.robot)] {
            if let Some(said) = said {
                let dir = dir.display();
                return Err(Error::Usage(format!("{flag} {said}: {dir} is a dataset of another program; leave out {flag}")));
            }
        }
        let (sets, given) = self.overrides(flags.iter());
        let loaded = LearningSettings::load(self.preset.unwrap_or_default(), self.pipeline.as_deref(), &sets);
        loaded.map_err(|e| in_words_of_flags(e, &given))
    }

    /// All overrides in their order, and those that flags stand for with the flags as they were typed.
    fn overrides<'a>(&self, flags: impl Iterator<Item = &'a Flag<'a>>) -> (Vec<String>, Vec<(String, String)>) {
        let given: Vec<(String, String)> =
            flags.filter_map(|(key, value)| value.as_ref().map(|v| (format!("{key}={v}"), flag_text(key, v)))).collect();
        let mut sets = split(self.sets.as_deref().unwrap_or_default());
        sets.extend(self.set.iter().chain(given.iter().map(|(set, _)| set)).cloned());
        (sets, given)
    }

    /// What made an artefact of `stage`: the settings it reads, the seed, the hashes of what it has read by role ("plans", "dataset").
    ///
    /// # Errors
    /// [`Error::Failed`] when a setting has no form in JSON.
    pub fn provenance(&self, stage: Stage, pipeline: &Pipeline, inputs: &[(&str, ContentHash)]) -> Result<Provenance> {
        let provenance = Provenance::new(stage.name(), &pipeline.task.name, pipeline.to_json(stage)?, self.seed);
        Ok(inputs.iter().fold(provenance, |provenance, (role, content)| provenance.with_input(role, content)))
    }
}

/// The task of `--task`.
fn task_said(said: &str) -> Result<ChosenTask> {
    ChosenTask::read(said).map_err(|why| Error::Usage(format!("--task: {why}")))
}

/// The words of a text; blanks inside brackets, braces and quotes separate nothing.
fn split(text: &str) -> Vec<String> {
    let (mut words, mut word, mut depth, mut quote) = (Vec::new(), String::new(), 0_usize, None);
    for c in text.chars() {
        match (quote, c) {
            (Some(open), _) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, _) if c.is_whitespace() && depth == 0 => {
                words.push(std::mem::take(&mut word));
                continue;
            }
            (None, _) => {}
        }
        word.push(c);
    }
    words.push(word);
    words.retain(|word| !word.is_empty());
    words
}

/// `train.rho` and 2 as they were typed: `--rho 2`.
fn flag_text(key: &str, value: &str) -> String {
    format!("--{} {value}", key.rsplit('.').next().unwrap_or(key))
}

/// A refusal of a flag names the flag, not the setting that it stands for.
fn in_words_of_flags(error: Error, given: &[(String, String)]) -> Error {
    let Error::Usage(message) = error else { return error };
    let flag = given.iter().find_map(|(set, flag)| Some((flag, message.strip_prefix(&format!("--set {set}"))?)));
    Error::Usage(flag.map_or_else(|| message.clone(), |(flag, rest)| format!("{flag}{rest}")))
}

/// The given path, or `name` under `runs/<task>/`, of another robot than the paper's under `runs/<robot>/<task>/`.
pub fn path_or(given: Option<&Path>, pipeline: &Pipeline, name: &str) -> PathBuf {
    let robot = if pipeline.robot.is_default() { "" } else { pipeline.robot.name.as_str() };
    given.map_or_else(|| Path::new(RUNS).join(robot).join(&pipeline.task.name).join(name), Path::to_path_buf)
}

/// Refuses an input that was made for another task, or for one of the same name that says something else.
///
/// # Errors
/// [`Error::Input`] naming both tasks.
pub fn same_task(path: &Path, made: &Provenance, pipeline: &Pipeline) -> Result<()> {
    let (theirs, ours) = (&made.task, &pipeline.task.name);
    if made.settings.get(FOREIGN).is_some() {
        return Err(Error::input(
            path,
            format!(
                "was learned from {theirs}, a dataset of another program, not from demos of {ours}: hilt has no simulator for it"
            ),
        ));
    }
    if theirs != ours {
        return Err(Error::input(
            path,
            format!("was made for task {theirs}, but task {ours} is asked for; give --task {theirs} or another file"),
        ));
    }
    // The paper's tasks leave it unsaid.
    let same = match made.settings["task"]["content"].as_str() {
        None => pipeline.task.is_of_the_paper(),
        Some(content) => content == pipeline.task.content(),
    };
    if same {
        return Ok(());
    }
    Err(Error::input(path, format!("was made for another task of the name {ours}: its file has changed since; make it anew")))
}

/// A network of the robot and task of `pipeline` from its weights: `make` makes it of their tensors and description, `layout` says what its rows hold.
///
/// # Errors
/// What reading returns; [`Error::Input`] for weights of another task, kind or layout, or that are no such network.
pub fn read_network<N>(
    path: &Path,
    kind: &str,
    pipeline: &Pipeline,
    make: fn(&[NamedTensor], &Value) -> std::result::Result<N, String>,
    layout: fn(&N) -> &Layout,
) -> Result<(N, Provenance, ContentHash)> {
    let (tensors, description, made, content) = weights::read_hashed(path, kind)?;
    same_task(path, &made, pipeline)?;
    let network = make(&tensors, &with_layout(description)).map_err(|why| Error::input(path, why))?;
    same_layout(path, &made, layout(&network), pipeline)?;
    Ok((network, made, content))
}

/// Refuses what another robot made; what does not say by whom was made by the Jaco, when there was no other.
///
/// # Errors
/// [`Error::Input`] naming both.
pub fn same_robot(path: &Path, made: &Provenance, pipeline: &Pipeline) -> Result<()> {
    let theirs = &made.settings["robot"];
    let same = match theirs["content"].as_str() {
        None => pipeline.robot.is_default(),
        Some(content) => content == pipeline.robot.content(),
    };
    if same {
        return Ok(());
    }
    let (theirs, ours) = (theirs["name"].as_str().unwrap_or("jaco"), &pipeline.robot.name);
    let hint = if theirs == ours { ", or its files have changed since".to_string() } else { format!("; give --robot {theirs}") };
    Err(Error::input(path, format!("was made by robot {theirs}, but {ours} is asked for{hint}, or make it anew")))
}

/// Refuses rows that are not those of the robot in the task: by the names of the robots that made them, where those differ.
///
/// # Errors
/// [`Error::Input`] with the robots, or the numbers of both.
pub fn same_layout(path: &Path, made: &Provenance, layout: &Layout, pipeline: &Pipeline) -> Result<()> {
    let ours = pipeline.task.layout(&pipeline.robot);
    if *layout == *ours {
        return Ok(());
    }
    same_robot(path, made, pipeline)?;
    let [theirs, ours] =
        [layout, &*ours].map(|l| format!("states of {} numbers and actions of {}", l.state_dim(), l.action_dim()));
    let robot = &pipeline.robot.name;
    let advice = "give --robot, or make it anew";
    Err(Error::input(
        path,
        format!("has {theirs}; {robot} in this task has {ours}, or in another order (\"layout\" says which): {advice}"),
    ))
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn blanks_separate_overrides_except_inside_brackets_and_quotes() {
        let obstacles = "scene.obstacles=[{center_m=[0.4, 0, 0.3], size_m=[0.1,0.1,0.1]}, {center_m=[0, 0, 1]}]";
        let name = "train.alpha=\"adaptive it is\"";
        assert_eq!(
            split(&format!(" plan.speed=0.5  {obstacles}\t{name} a.b='] ['\n")),
            ["plan.speed=0.5", obstacles, name, "a.b='] ['"]
        );
        assert_eq!(split(" \n"), [] as [&str; 0]);
        assert_eq!(split("a.b=]1 c.d=[2 3"), ["a.b=]1", "c.d=[2 3"]);
    }
}
