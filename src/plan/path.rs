//! Hand paths: straight lines with rounded corners, hand level, turned into joint angles by inverse kinematics.

use crate::joints::Joints;
use crate::robot::{Ik, Unreachable};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector4};

/// A level pose of the hand: tool point x y z \[m\], then yaw times [`YAW_LEVER_M`] \[m\], so that lengths and corners mean something.
pub(super) type Knot = Vector4<f64>;

/// How far a radian of yaw counts against a metre \[m/rad\].
pub(super) const YAW_LEVER_M: f64 = 0.15;
/// Distance between samples of a path \[m\]: joint angles are interpolated in between, off by less than 0.1 mm.
const SAMPLE_M: f64 = 0.025;
/// Points on a rounded corner.
const CORNER_POINTS: usize = 8;

/// A level hand with its tool point at `position_m`, turned by `yaw_rad`.
pub(super) fn knot(position_m: [f64; 3], yaw_rad: f64) -> Knot {
    let [x, y, z] = position_m;
    Knot::new(x, y, z, yaw_rad * YAW_LEVER_M)
}

/// `world_from_tool` of a knot.
pub(super) fn tool_pose(knot: &Knot) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, knot.w / YAW_LEVER_M);
    Isometry3::from_parts(Translation3::new(knot.x, knot.y, knot.z), turn)
}

/// Replaces each inner knot by a parabola that leaves the straight legs `corner_m` before it (at most half a leg).
pub(super) fn round_corners(knots: &[Knot], corner_m: f64) -> Vec<Knot> {
    let mut line = vec![knots[0]];
    for around in knots.windows(3) {
        let (before, corner, after) = (around[0], around[1], around[2]);
        let cut = |other: Knot| {
            let leg = other - corner;
            let length = leg.norm();
            corner + leg * (corner_m.min(length / 2.0) / length.max(f64::MIN_POSITIVE))
        };
        let (enter, leave) = (cut(before), cut(after));
        for k in 0..=CORNER_POINTS {
            let t = k as f64 / CORNER_POINTS as f64;
            line.push(enter * (1.0 - t).powi(2) + corner * (2.0 * t * (1.0 - t)) + leave * t.powi(2));
        }
    }
    line.push(knots[knots.len() - 1]);
    line
}

/// Samples a line at equal distances, both ends included.
pub(super) fn resample(line: &[Knot]) -> Vec<Knot> {
    let length: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let pieces = (length / SAMPLE_M).ceil().max(2.0) as usize;
    let mut samples = Vec::with_capacity(pieces + 1);
    let (mut leg, mut walked) = (0, 0.0);
    for k in 0..=pieces {
        let at = length * k as f64 / pieces as f64;
        while leg + 2 < line.len() && walked + (line[leg + 1] - line[leg]).norm() < at {
            walked += (line[leg + 1] - line[leg]).norm();
            leg += 1;
        }
        let step = line[leg + 1] - line[leg];
        let share = if step.norm() > 0.0 { ((at - walked) / step.norm()).clamp(0.0, 1.0) } else { 0.0 };
        samples.push(line[leg] + step * share);
    }
    samples
}

/// Joint angles \[rad\] at equal distances along the rounded path through `knots`, beginning at `start` (whose tool is at the first knot).
///
/// # Errors
/// The first sample that cannot be reached.
pub(super) fn follow(ik: &mut Ik, knots: &[Knot], corner_m: f64, start: &Joints) -> Result<Vec<Joints>, Unreachable> {
    let samples = resample(&round_corners(knots, corner_m));
    let mut q = Vec::with_capacity(samples.len());
    q.push(*start);
    for sample in &samples[1..] {
        let seed = match q[..] {
            [.., before, last] => Joints::from_fn(last.len(), |i| 2.0 * last[i] - before[i]),
            _ => *start,
        };
        q.push(ik.solve(&tool_pose(sample), &seed)?);
    }
    Ok(q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_the_ends_and_stays_near_the_corner() {
        let knots = [knot([0.0, 0.0, 0.1], 0.0), knot([0.2, 0.0, 0.1], 0.0), knot([0.2, 0.0, 0.0], 0.0)];
        let samples = resample(&round_corners(&knots, 0.05));
        assert_eq!((samples[0], samples[samples.len() - 1]), (knots[0], knots[2]));
        let nearest = samples.iter().map(|s| (s - knots[1]).norm()).fold(f64::INFINITY, f64::min);
        assert!((0.01..0.03).contains(&nearest), "{nearest} m from the corner");
        let steps: Vec<f64> = samples.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
        assert!(steps.iter().all(|s| *s <= SAMPLE_M + 1e-9 && *s > 0.8 * SAMPLE_M), "{steps:?}");
    }
}
