//! For which task and robot an artefact was made: what no flag has to say again.

use super::fits::robot_of;
use crate::config::ChosenTask;
use crate::data::origin::{Kind, provenance};
use crate::error::{Error, Result};
use crate::robot::file::built_in as robots;
use crate::task::built_in as tasks;
use std::path::Path;

/// What an artefact says.
pub struct MadeFor {
    /// The task's name, or its file.
    pub task: String,
    /// The robot; `None` for one of a file.
    pub robot: Option<String>,
}

impl MadeFor {
    /// Reads it. A task that does not come with hilt has a file, which only others can name: `own`, of the same task.
    ///
    /// # Errors
    /// What reading returns; [`Error::Usage`] for a task whose file nobody names.
    pub fn read(path: &Path, kind: Kind, own: Option<&str>) -> Result<Self> {
        let made = provenance(path, kind)?;
        let own = own.filter(|said| ChosenTask::read(said).is_ok_and(|task| task.name == made.task));
        let task = match own {
            Some(own) => own.to_string(),
            None if tasks::names().contains(&made.task.as_str()) => made.task.clone(),
            None => {
                let (path, task) = (path.display(), &made.task);
                return Err(Error::Usage(format!(
                    "which task? {path} was made for {task}, which does not come with hilt; give --task FILE.toml or --pipeline FILE"
                )));
            }
        };
        let robot = Some(robot_of(&made)).filter(|name| robots::names().contains(&name.as_str()));
        Ok(MadeFor { task, robot })
    }
}
