//! `hilt.toml`: what is said once for a directory and all below it, instead of with every command.

use super::pipeline_file::{ROBOT, TASK, lay_over, read_table};
use super::{Pipeline, Preset, check};
use crate::error::{Error, Result};
use crate::task::built_in;
use crate::words::{shown, unknown};
use std::path::{Path, PathBuf};

/// Its name.
const NAME: &str = "hilt.toml";
const PRESET: &str = "preset";
const PIPELINE: &str = "pipeline";
/// What stands outside of all sections: flags that a command is not given.
const FLAGS: [&str; 4] = [TASK, ROBOT, PRESET, PIPELINE];

/// What such a file says. Paths in it are relative to it.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectFile {
    /// The file.
    pub path: PathBuf,
    /// The task's name or file.
    pub task: Option<String>,
    /// The robot's name or file.
    pub robot: Option<String>,
    /// The preset; never with a pipeline file.
    pub preset: Option<Preset>,
    /// The pipeline file.
    pub pipeline: Option<PathBuf>,
    /// Sections, over those of preset or pipeline file.
    pub(super) settings: toml::Table,
}

impl ProjectFile {
    /// The nearest one: in `dir`, or in a directory above it. A link that leads nowhere is one too, which cannot be read.
    pub fn above(dir: &Path) -> Option<PathBuf> {
        dir.ancestors().map(|dir| dir.join(NAME)).find(|file| file.is_file() || file.is_symlink() && !file.exists())
    }

    /// That of the working directory.
    pub fn here() -> Option<PathBuf> {
        Self::above(&std::env::current_dir().ok()?)
    }

    /// Reads one, and checks its settings.
    ///
    /// # Errors
    /// [`Error::Usage`] names the key, its value and what is allowed; [`Error::Io`] when the file cannot be read.
    pub fn read(path: &Path) -> Result<Self> {
        let refuse = |why: String| Error::Usage(format!("{}: {why}", path.display()));
        let mut settings = read_table(path)?;
        if settings.get(TASK).is_some_and(toml::Value::is_table) {
            let message = "[task] defines a task, which belongs in a file of its own: write task = \"FILE.toml\" here, or pipeline = \"FILE.toml\" where that \
                           file has all settings";
            return Err(refuse(message.into()));
        }
        let mut flags = [const { None }; FLAGS.len()];
        for (flag, key) in flags.iter_mut().zip(FLAGS) {
            *flag = match settings.remove(key) {
                Some(toml::Value::String(said)) => Some(said),
                Some(other) => return Err(refuse(format!("{key} = {}: expected a text in quotes", shown(&other.to_string())))),
                None => None,
            };
        }
        let [task, robot, preset, pipeline] = flags;
        if let Some((key, _)) = settings.iter().find(|(_, value)| !value.is_table()) {
            let what = unknown("key", key, &FLAGS);
            return Err(refuse(format!("{what}; anything else stands in a section, [train] for example")));
        }
        if preset.is_some() && pipeline.is_some() {
            return Err(refuse("preset and pipeline both say what every setting is: leave one out".into()));
        }
        let preset = preset.map(|name| name.parse().map_err(|why| refuse(format!("preset: {why}")))).transpose()?;
        let pipeline = pipeline.map(|file| path.parent().unwrap_or(Path::new("")).join(file));
        // What it says is wrong or right whatever the command; values that go together only with a pipeline's are checked again.
        let mut all = Pipeline::defaults(&built_in::pick_up()).to_table()?;
        lay_over(&mut all, settings.clone());
        check::resolve(all, &path.display().to_string())?;
        Ok(ProjectFile { path: path.into(), task, robot, preset, pipeline, settings })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ChosenTask, LearningSettings, Source};
    use super::*;

    fn written(text: &str) -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join(NAME);
        std::fs::write(&path, text).expect("written");
        (dir, path)
    }

    #[test]
    fn the_nearest_file_lies_between_the_preset_and_what_is_set() {
        let text = "task = \"stack\"\nrobot = \"mine/arm.toml\"\n[train]\nepochs = 7\nrho = 0.4\n[scene]\nyaw = true\n\
                    obstacles = [{ center_m = [0.4, 0.0, 0.3], size_m = [0.1, 0.1, 0.1] }]\n";
        let (dir, path) = written(text);
        let below = dir.path().join("a/b");
        std::fs::create_dir_all(&below).expect("made");
        assert_eq!(ProjectFile::above(&below), Some(path.clone()));
        let file = ProjectFile::read(&path).expect("a file");
        assert_eq!(file.robot, Some(dir.path().join("mine/arm.toml").display().to_string()), "relative to the file");
        let source = Source::BuiltIn(ChosenTask::read("stack").expect("a task"), Preset::Best);
        let found = Pipeline::load_with(&source, Some(&file), &["train.rho=0.2".into()]).expect("settings");
        assert_eq!((found.train.epochs, found.train.rho, found.scene.obstacles.len()), (7, 0.2, 1));
        assert_eq!(found.plan, Pipeline::load(&source, &[]).expect("settings").plan);
        // Of a dataset of another program, what is about a scene is for another use.
        let found = LearningSettings::load(Preset::Best, None, Some(&file), &[]).expect("settings");
        assert_eq!(found.train.epochs, 7);
    }

    #[test]
    fn what_is_wrong_is_named_with_the_file() {
        for (text, said) in [
            ("task = 3", "hilt.toml: task = 3: expected a text in quotes"),
            ("rho = 0.3", "hilt.toml: unknown key \"rho\""),
            ("[train]\nepoch = 3", "hilt.toml: unknown key train.epoch; did you mean train.epochs?"),
            ("[train]\nrho = 2.0", "hilt.toml: train.rho = 2"),
            ("preset = \"bst\"", "did you mean best?"),
            ("preset = \"best\"\npipeline = \"a.toml\"", "leave one out"),
            ("[task]\nname = \"stack\"", "write task = \"FILE.toml\" here"),
            ("[train", "hilt.toml is not valid TOML"),
        ] {
            let why = ProjectFile::read(&written(text).1).expect_err(text).to_string();
            assert!(why.contains(said), "{text}: {why}");
        }
    }
}
