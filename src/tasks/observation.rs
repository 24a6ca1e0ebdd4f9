//! What there is to see of a moment.

use crate::demo::{Body, Contacts};
use crate::robot::Robot;
use crate::state::State;
use nalgebra::Vector3;
use std::sync::Arc;

/// A finger presses when its normal force on the object exceeds this \[N\]; the block weighs about 1 N.
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
    /// The task's objects now.
    pub objects: Vec<Body>,
    /// Contacts now.
    pub contacts: Contacts,
}

impl Observation {
    /// Where an object's centre is now \[m\].
    pub fn at(&self, object: usize) -> [f64; 3] {
        self.objects[object].pose.position_m
    }

    /// Distance of an object's centre to `target` \[m\].
    pub fn distance(&self, object: usize, target_m: [f64; 3]) -> f64 {
        (Vector3::from(self.at(object)) - Vector3::from(target_m)).norm()
    }

    /// Whether no finger touches an object.
    pub fn released(&self, object: usize) -> bool {
        self.contacts.objects[object].fingers_n.iter().all(|f| *f <= 0.0)
    }

    /// Whether an object touches the table or another object.
    pub fn touches(&self, object: usize) -> bool {
        let touch = &self.contacts.objects[object];
        touch.table || !touch.objects.is_empty()
    }

    /// Whether two fingers that oppose each other press an object.
    pub fn gripped(&self, object: usize) -> bool {
        self.robot.grips(|finger| self.contacts.objects[object].fingers_n[finger] > PRESS_N)
    }

    /// Whether an object is at rest.
    pub fn rests(&self, object: usize) -> bool {
        self.objects[object].speed_m_s < REST_SPEED_M_S
    }
}
