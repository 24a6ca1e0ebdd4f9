//! The flags that all stages share: which settings, which seed.

use super::Console;
use super::made_for::MadeFor;
use super::places::Places;
use crate::config::{self, ChosenTask, LearningSettings, Pipeline, Preset, ProjectFile, Source, Stage};
use crate::data::origin::Kind;
use crate::data::{ContentHash, Provenance};
use crate::error::{Error, Result};
use crate::plan::check_ready_pose;
use crate::task::built_in;
use std::path::{Path, PathBuf};

/// Where artefacts go unless a flag says otherwise.
pub const RUNS: &str = "runs";

/// Which settings: a preset of a task or a pipeline file, then `--set`, then flags of the stage.
#[derive(Debug, clap::Args)]
pub struct SettingsArgs {
    /// Task: pick-up, pick-and-place, stack, tower, sort, bin, or the TOML file of another [default: that of the artefact that is read]
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
    /// What is said once for a directory instead of with every command: a hilt.toml, or none [default: hilt.toml here or in a directory above,
    /// but none with --pipeline]
    #[arg(long, value_name = "FILE|none")]
    config: Option<PathBuf>,
    /// Override one setting, in TOML; may be repeated (--set plan.speed=0.5 --set scene.yaw=true)
    #[arg(long, value_name = "STAGE.KEY=VALUE")]
    set: Vec<String>,
    /// Overrides in one text, separated by blanks; a blank inside brackets or quotes belongs to the value (SET=... of make)
    #[arg(long, value_name = "TEXT")]
    sets: Option<String>,
    /// Seed of every random number
    #[arg(long, value_name = "S", default_value_t = 0, allow_negative_numbers = true)]
    pub seed: u64,
}

/// What `--config` says for no file.
const NO_CONFIG: &str = "none";

/// A flag that stands for one setting.
pub type Flag<'a> = (&'a str, Option<String>);

impl SettingsArgs {
    /// What these settings are read from, where that is a file; says which `hilt.toml` counts, where one does.
    pub fn places(&self, console: &Console) -> Places {
        let project = self.project_file();
        if let Some(project) = &project {
            console.say(&format!("settings: also those of {}", project.display()));
        }
        let said = [self.robot.as_deref(), self.task.as_deref()].into_iter().flatten().map(Path::new);
        let files = self.pipeline.as_deref().into_iter().chain(project.as_deref()).chain(said.filter(|path| path.is_file()));
        Places::new().read_all(files)
    }

    /// The `hilt.toml` that counts here. A pipeline file says every setting, so that with it none does unless it is named.
    fn project_file(&self) -> Option<PathBuf> {
        match &self.config {
            Some(none) if none.as_os_str() == NO_CONFIG => None,
            Some(file) => Some(file.clone()),
            None if self.pipeline.is_some() => None,
            None => ProjectFile::here(),
        }
    }

    fn project(&self) -> Result<Option<ProjectFile>> {
        self.project_file().map(|file| ProjectFile::read(&file)).transpose()
    }

    /// The resolved settings; `flags` are dotted keys with the values of the stage's own flags, where given.
    ///
    /// # Errors
    /// [`Error::Usage`] when neither task nor pipeline file is given; see [`Pipeline::load`].
    pub fn resolve(&self, flags: &[Flag]) -> Result<Pipeline> {
        self.resolve_from(None, flags)
    }

    /// As [`SettingsArgs::resolve`]; where no flag says the task, task and robot are those that an artefact was made for.
    ///
    /// # Errors
    /// Also what reading the artefact returns.
    pub fn resolve_from(&self, artefact: Option<(&Path, Kind)>, flags: &[Flag]) -> Result<Pipeline> {
        let project = self.project()?;
        let project = project.as_ref();
        let file = self.pipeline_file(project);
        let unsaid = self.task.is_none() && file.is_none();
        let own_task = project.and_then(|project| project.task.clone());
        let read = |(path, kind)| MadeFor::read(path, kind, own_task.as_deref());
        let made_for = artefact.filter(|_| unsaid).map(read).transpose()?;
        let made = made_for.as_ref();
        let task = self.task.clone().or_else(|| made.map(|made| made.task.clone())).or(own_task);
        let robot = self.robot.clone().or_else(|| made?.robot.clone()).or_else(|| project?.robot.clone());
        let preset = self.preset.or_else(|| project?.preset);
        let from_project = project.filter(|project| self.task.is_none() && task.is_some() && task == project.task);
        let chosen = |said: &str| match from_project {
            Some(project) => {
                ChosenTask::read(said).map_err(|why| Error::Usage(format!("{}: task: {why}", project.path.display())))
            }
            None => task_said(said),
        };
        let source = match (file, task.as_deref()) {
            (Some(path), said) => Source::File(path, said.map(chosen).transpose()?),
            // A task's file is a pipeline file.
            (None, Some(said)) if preset.is_none() && config::is_file(said) => Source::File(said.into(), None),
            (None, Some(said)) => Source::BuiltIn(chosen(said)?, preset.unwrap_or_default()),
            (None, None) => {
                let tasks = built_in::names().join(", ");
                return Err(Error::Usage(format!("which task? give --task ({tasks}, or a file) or --pipeline FILE")));
            }
        };
        let (sets, given) = self.overrides([&("robot", robot)].into_iter().chain(flags));
        let pipeline = Pipeline::load_with(&source, project, &sets).map_err(|e| in_words_of_flags(e, &given))?;
        check_ready_pose(&pipeline.robot, &pipeline.scene)?;
        Ok(pipeline)
    }

    /// The pipeline file, unless a preset is asked for in its place.
    fn pipeline_file(&self, project: Option<&ProjectFile>) -> Option<PathBuf> {
        self.pipeline.clone().or_else(|| project.filter(|_| self.preset.is_none())?.pipeline.clone())
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
        let project = self.project()?;
        let preset = self.preset.or_else(|| project.as_ref()?.preset).unwrap_or_default();
        let file = self.pipeline_file(project.as_ref());
        let loaded = LearningSettings::load(preset, file.as_deref(), project.as_ref(), &sets);
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
///
/// # Errors
/// [`Error::Usage`] when there is none of this name.
pub fn task_said(said: &str) -> Result<ChosenTask> {
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
    // A unit belongs to a setting's name, not to the flag's.
    format!("--{} {value}", key.rsplit('.').next().unwrap_or(key).trim_end_matches("_steps"))
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
