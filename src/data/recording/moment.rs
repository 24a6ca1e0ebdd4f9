//! What both readers of steps take from messages: the one of today and the one of older files.

use crate::data::proto;
use crate::demo::Body;
use crate::state::Pose;

/// What a step says of the task's objects.
pub(super) struct Moment {
    pub(super) seen: Vec<Pose>,
    pub(super) goals: Vec<[f64; 3]>,
    pub(super) objects: Vec<Body>,
    pub(super) touches: Vec<proto::Touch>,
}

pub(super) fn fixed<const N: usize>(name: &str, values: &[f64]) -> Result<[f64; N], String> {
    values.try_into().map_err(|_| format!("{name} has {} numbers, expected {N}", values.len()))
}

pub(super) fn pose(name: &str, message: Option<&proto::Pose>) -> Result<Pose, String> {
    let message = message.ok_or_else(|| format!("{name} is missing"))?;
    Ok(Pose { position_m: fixed(name, &message.position_m)?, quaternion_xyzw: fixed(name, &message.quaternion_xyzw)? })
}
