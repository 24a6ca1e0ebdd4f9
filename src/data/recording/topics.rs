//! Topics of our own messages.

/// What stood where at the start.
pub const SCENE_TOPIC: &str = "/hilt/scene";
/// Every control step, then the final state.
pub const STEP_TOPIC: &str = "/hilt/step";
/// Success or failure class.
pub const OUTCOME_TOPIC: &str = "/hilt/outcome";
