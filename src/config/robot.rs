//! Which robot a pipeline is for.

use crate::robot::Robot;
use crate::robot::file::{self, built_in};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::Deref;
use std::path::{Path, absolute};
use std::sync::Arc;

/// The paper's arm.
const DEFAULT: &str = "jaco";
/// Ending of the file of a robot or a task; what does not end so is a name.
const ENDING: &str = "toml";

/// `robot = "NAME"` or `robot = "path/to/FILE.toml"`, read.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenRobot {
    /// As it was said.
    said: String,
    robot: Arc<Robot>,
}

impl ChosenRobot {
    /// Reads the robot of this name, or in this file.
    ///
    /// # Errors
    /// Says which names there are, or what is wrong with the file.
    pub fn read(said: &str) -> Result<Self, String> {
        let (said, robot) = match built_in::named(said) {
            Some(robot) => (said.to_string(), robot?),
            None if is_file(said) => {
                // So that the settings can be written to another place.
                let path = absolute(said).map_err(|why| format!("{said}: {why}"))?;
                (path.display().to_string(), file::read(Path::new(said)).map_err(|why| why.to_string())?.robot)
            }
            None => (said.to_string(), built_in::find(said).map_err(|why| why.to_string())?),
        };
        Ok(ChosenRobot { said, robot: Arc::new(robot) })
    }

    /// Whether it is the one where none is named, whatever its files are called.
    pub fn is_default(&self) -> bool {
        *self.robot == *built_in::paper_robot()
    }

    /// Hash of all that is known of it, whatever its files are called.
    pub fn content(&self) -> String {
        let text = serde_json::to_vec(&*self.robot).expect("a robot is plain data with text keys");
        blake3::hash(&text).to_hex().to_string()
    }
}

/// Whether the name of a robot or a task is that of a file.
pub fn is_file(said: &str) -> bool {
    Path::new(said).extension().is_some_and(|ending| ending == ENDING)
}

impl From<Arc<Robot>> for ChosenRobot {
    fn from(robot: Arc<Robot>) -> Self {
        ChosenRobot { said: robot.name.clone(), robot }
    }
}

impl Default for ChosenRobot {
    /// The paper's arm.
    fn default() -> Self {
        ChosenRobot { said: DEFAULT.into(), robot: built_in::paper_robot() }
    }
}

impl Deref for ChosenRobot {
    type Target = Arc<Robot>;

    fn deref(&self) -> &Arc<Robot> {
        &self.robot
    }
}

impl Serialize for ChosenRobot {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.said.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ChosenRobot {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        ChosenRobot::read(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}
