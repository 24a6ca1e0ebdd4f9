//! Which task a pipeline is for.

use super::pipeline_file::read_table;
use super::robot::is_file;
use crate::task::{Task, built_in};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

/// `task = "NAME"`, `task = "path/to/FILE.toml"` (of whose `[task]`), or `[task]`, read.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenTask(Arc<Task>);

impl ChosenTask {
    /// The task of this name, or the one in this file.
    ///
    /// # Errors
    /// Says which names there are, or what is wrong with the file.
    pub fn read(said: &str) -> Result<Self, String> {
        if !is_file(said) {
            return built_in::find(said).map(ChosenTask);
        }
        let mut file = read_table(Path::new(said)).map_err(|why| why.to_string())?;
        match file.remove("task") {
            Some(task @ toml::Value::Table(_)) => of_table(task).map_err(|why| format!("{said}: [task]: {why}")),
            Some(toml::Value::String(name)) => built_in::find(&name).map(ChosenTask).map_err(|why| format!("{said}: {why}")),
            _ => Err(format!("{said} says no task: add [task] with objects and goals, or task = \"{}\"", built_in::names()[0])),
        }
    }

    /// Whether it is one of the paper's three.
    pub fn is_of_the_paper(&self) -> bool {
        built_in::of_the_paper().contains(&self.0)
    }

    /// Hash of all that is said of it.
    pub fn content(&self) -> String {
        let text = serde_json::to_vec(&*self.0).expect("a task is plain data with text keys");
        blake3::hash(&text).to_hex().to_string()
    }
}

/// Of `[task]`; what is wrong with it is said with the key.
fn of_table(task: toml::Value) -> Result<ChosenTask, String> {
    let task: Result<Task, _> = serde_path_to_error::deserialize(task);
    task.map(|task| ChosenTask(Arc::new(task))).map_err(|why| match why.path().to_string() {
        key if key == "." => why.inner().message().into(),
        key => format!("{key}: {}", why.inner().message()),
    })
}

impl From<Arc<Task>> for ChosenTask {
    fn from(task: Arc<Task>) -> Self {
        ChosenTask(task)
    }
}

impl Deref for ChosenTask {
    type Target = Arc<Task>;

    fn deref(&self) -> &Arc<Task> {
        &self.0
    }
}

impl Serialize for ChosenTask {
    /// The name of one that comes with hilt, all of another: settings stand by themselves.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if built_in::all().contains(&self.0) { self.0.name.serialize(serializer) } else { self.0.serialize(serializer) }
    }
}

impl<'de> Deserialize<'de> for ChosenTask {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let task = match toml::Value::deserialize(deserializer)? {
            toml::Value::String(said) => ChosenTask::read(&said),
            said @ toml::Value::Table(_) => of_table(said),
            _ => Err("expected a task's name or its file in quotes, or a table [task]".into()),
        };
        task.map_err(serde::de::Error::custom)
    }
}
