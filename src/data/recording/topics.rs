//! Topics of our own messages, and names of what is attached.

/// What stood where at the start.
pub const SCENE_TOPIC: &str = "/hilt/scene";
/// Every control step, then the final state.
pub const STEP_TOPIC: &str = "/hilt/step";
/// Success or failure class.
pub const OUTCOME_TOPIC: &str = "/hilt/outcome";
/// Name of the attached robot description for viewers.
pub const URDF_NAME: &str = "robot.urdf";
/// Name of the attached robot, all that hilt knows of it.
pub const ROBOT_NAME: &str = "robot.json";
/// Name of the attached task.
pub const TASK_NAME: &str = "task.json";
/// Robot and surroundings as a URDF, on the topic on which viewers look for it.
pub const DESCRIPTION_TOPIC: &str = "/robot_description";
