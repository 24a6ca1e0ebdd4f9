//! Our nalgebra poses in f64 to and from rapier's glam poses in f32.

use crate::state::Pose;
use nalgebra::{Isometry3, UnitQuaternion};
use rapier3d::math::{Pose as RapierPose, Real, Rotation, Vector};

/// A vector in rapier's precision.
pub(super) fn vector(v: [f64; 3]) -> Vector {
    Vector::new(v[0] as Real, v[1] as Real, v[2] as Real)
}

/// A rotation in rapier's precision.
pub(super) fn rotation(turn: &UnitQuaternion<f64>) -> Rotation {
    let [x, y, z, w]: [Real; 4] = turn.coords.map(|v| v as Real).into();
    Rotation::from_xyzw(x, y, z, w).normalize()
}

/// A pose in rapier's precision.
pub(super) fn pose(p: &Pose) -> RapierPose {
    let [x, y, z, w] = p.quaternion_xyzw.map(|v| v as Real);
    RapierPose::from_parts(vector(p.position_m), Rotation::from_xyzw(x, y, z, w).normalize())
}

/// An isometry in rapier's precision.
pub(super) fn isometry(iso: &Isometry3<f64>) -> RapierPose {
    pose(&Pose::from_isometry(iso))
}

/// A pose of rapier, exactly.
pub(super) fn to_pose(p: &RapierPose) -> Pose {
    let (t, r) = (p.translation, p.rotation);
    Pose { position_m: [t.x, t.y, t.z].map(f64::from), quaternion_xyzw: [r.x, r.y, r.z, r.w].map(f64::from) }
}
