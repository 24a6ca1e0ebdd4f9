//! For which task and robot an artefact was made: what no flag has to say again.

use crate::data::origin::{Kind, provenance};
use crate::error::{Error, Result};
use crate::robot::file::built_in as robots;
use crate::task::built_in as tasks;
use std::path::Path;

/// What an artefact says, where hilt knows it by name.
pub struct MadeFor {
    /// The task.
    pub task: String,
    /// The robot; `None` for the paper's, which no artefact names, and for one of a file.
    pub robot: Option<String>,
}

impl MadeFor {
    /// Reads it.
    ///
    /// # Errors
    /// What reading returns; [`Error::Usage`] for a task that does not come with hilt, whose file only a flag can name.
    pub fn read(path: &Path, kind: Kind) -> Result<Self> {
        let made = provenance(path, kind)?;
        if !tasks::names().contains(&made.task.as_str()) {
            let (path, task) = (path.display(), &made.task);
            return Err(Error::Usage(format!(
                "which task? {path} was made for {task}, which does not come with hilt; give --task FILE.toml or --pipeline FILE"
            )));
        }
        let robot = made.settings["robot"]["name"].as_str().filter(|name| robots::names().contains(name));
        Ok(MadeFor { robot: robot.map(String::from), task: made.task })
    }
}
