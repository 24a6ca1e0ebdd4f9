//! What there is to see of a moment.

use crate::demo::Contacts;
use crate::robot::Robot;
use crate::state::{Pose, State};
use nalgebra::Vector3;
use std::sync::Arc;

/// A finger presses when its normal force on the block exceeds this \[N\]; the block weighs about 1 N.
const PRESS_N: f64 = 0.05;
/// At rest below this speed \[m/s\].
pub(super) const REST_SPEED_M_S: f64 = 0.01;

/// What the simulator shows of one moment.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Who acts.
    pub robot: Arc<Robot>,
    /// s_t.
    pub state: State,
    /// Tool point in the world \[m\].
    pub tool_m: [f64; 3],
    /// Pose of the base block now, if there is one.
    pub base_now: Option<Pose>,
    /// Contacts now.
    pub contacts: Contacts,
    /// Speed of the block's centre \[m/s\].
    pub block_speed_m_s: f64,
}

impl Observation {
    /// Distance of the block's centre to `target` \[m\].
    pub fn block_to(&self, target_m: [f64; 3]) -> f64 {
        (Vector3::from(self.state.block.position_m) - Vector3::from(target_m)).norm()
    }

    /// Whether no finger touches the block.
    pub fn released(&self) -> bool {
        self.contacts.finger_block_n.iter().all(|f| *f <= 0.0)
    }

    /// Whether two fingers that oppose each other press the block.
    pub fn gripped(&self) -> bool {
        self.robot.grips(|finger| self.contacts.finger_block_n[finger] > PRESS_N)
    }
}
