//! Distances between convex primitives. All are exact or lower bounds, so "farther than" never errs on the wrong side.

use super::model::{Robot, Shape};
use nalgebra::{Isometry3, Point3, Vector3};

/// Rounds of the search for the point of a segment nearest to a box; each shrinks the interval by 0.62.
const GOLDEN_ROUNDS: usize = 20;
/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Edges nearer to parallel than this have no separating direction of their own.
const PARALLEL: f64 = 1e-9;

/// A primitive in the world frame.
#[derive(Clone, Copy, Debug)]
pub enum Solid {
    /// Segment with a radius.
    Capsule {
        /// One end \[m\].
        from: Point3<f64>,
        /// Other end \[m\].
        to: Point3<f64>,
        /// \[m\].
        radius_m: f64,
    },
    /// Box with its pose.
    Cuboid {
        /// Centre and axes.
        pose: Isometry3<f64>,
        /// Half of its edges \[m\].
        half_m: Vector3<f64>,
    },
}

impl Solid {
    /// A box.
    pub fn cuboid(pose: Isometry3<f64>, half_m: [f64; 3]) -> Self {
        Solid::Cuboid { pose, half_m: half_m.into() }
    }

    /// A primitive of a link that stands at `pose`.
    pub fn of(shape: &Shape, pose: &Isometry3<f64>) -> Self {
        match *shape {
            Shape::Capsule { from_m, to_m, radius_m } => {
                Solid::Capsule { from: pose * Point3::from(from_m), to: pose * Point3::from(to_m), radius_m }
            }
            Shape::Box { pose: at, half_m } => Solid::cuboid(pose * at, half_m),
        }
    }

    /// Centre and radius of a sphere around it.
    pub fn sphere(&self) -> (Point3<f64>, f64) {
        match self {
            Solid::Capsule { from, to, radius_m } => (nalgebra::center(from, to), nalgebra::distance(from, to) / 2.0 + radius_m),
            Solid::Cuboid { pose, half_m } => (pose.translation.vector.into(), half_m.norm()),
        }
    }

    /// Height of its lowest point \[m\].
    pub fn lowest_m(&self) -> f64 {
        match self {
            Solid::Capsule { from, to, radius_m } => from.z.min(to.z) - radius_m,
            Solid::Cuboid { pose, half_m } => {
                let down = pose.rotation.inverse() * Vector3::z();
                pose.translation.z - down.abs().dot(half_m)
            }
        }
    }

    /// How far it reaches from the origin in a direction, a unit vector \[m\].
    pub fn reach_m(&self, direction: &Vector3<f64>) -> f64 {
        match self {
            Solid::Capsule { from, to, radius_m } => direction.dot(&from.coords).max(direction.dot(&to.coords)) + radius_m,
            Solid::Cuboid { pose, half_m } => {
                let own = pose.rotation.inverse() * direction;
                direction.dot(&pose.translation.vector) + own.abs().dot(half_m)
            }
        }
    }

    /// Whether the two are at least `margin_m` apart.
    pub fn farther_than(&self, other: &Solid, margin_m: f64) -> bool {
        let ((a, reach_a), (b, reach_b)) = (self.sphere(), other.sphere());
        nalgebra::distance(&a, &b) - reach_a - reach_b >= margin_m || self.distance_m(other) >= margin_m
    }

    /// Distance (0 or less when they overlap; between boxes a lower bound) \[m\].
    pub fn distance_m(&self, other: &Solid) -> f64 {
        match (self, other) {
            (Solid::Capsule { from: a, to: b, radius_m: r }, Solid::Capsule { from: c, to: d, radius_m: s }) => {
                segment_to_segment_m([a, b], [c, d]) - r - s
            }
            (Solid::Capsule { from, to, radius_m }, Solid::Cuboid { pose, half_m })
            | (Solid::Cuboid { pose, half_m }, Solid::Capsule { from, to, radius_m }) => {
                segment_to_box_m(&pose.inverse_transform_point(from), &pose.inverse_transform_point(to), half_m) - radius_m
            }
            (Solid::Cuboid { pose: a, half_m: h }, Solid::Cuboid { pose: b, half_m: k }) => box_separation_m(a, h, b, k),
        }
    }
}

impl Robot {
    /// The collision primitives at these poses of the links, each with its link.
    pub fn solids(&self, poses: &[Isometry3<f64>]) -> Vec<(usize, Solid)> {
        let of_link = |(link, pose): (usize, &Isometry3<f64>)| {
            let pose = *pose;
            self.links[link].shapes.iter().map(move |shape| (link, Solid::of(shape, &pose)))
        };
        poses.iter().enumerate().flat_map(of_link).collect()
    }
}

/// What touches in a pose of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clash {
    /// A link reaches below the table on which the foot stands.
    Table(usize),
    /// Two links come near to each other, the one nearer to the foot first.
    Links(usize, usize),
}

impl Robot {
    /// What clashes at these poses of the links: links in the table, and links nearer to each other than `margin_m` that are not next to each other.
    pub fn clashes(&self, poses: &[Isometry3<f64>], margin_m: f64) -> Vec<Clash> {
        let solids = |link: usize| self.links[link].shapes.iter().map(move |shape| Solid::of(shape, &poses[link]));
        let parent = |link: usize| link.checked_sub(1).map(|joint| self.joints[joint].parent);
        let mut clashes = Vec::new();
        for a in 0..self.links.len() {
            if a > 0 && solids(a).any(|solid| solid.lowest_m() < 0.0) {
                clashes.push(Clash::Table(a));
            }
            for b in a + 1..self.links.len() {
                // What hangs on each other, or on the same link, touches by its nature; so do links two apart around a short one.
                let kin = parent(b) == Some(a) || parent(a) == parent(b) || parent(b).and_then(parent) == Some(a);
                if !kin && solids(a).any(|one| solids(b).any(|other| !one.farther_than(&other, margin_m))) {
                    clashes.push(Clash::Links(a, b));
                }
            }
        }
        clashes
    }
}

fn segment_to_segment_m([a, b]: [&Point3<f64>; 2], [c, d]: [&Point3<f64>; 2]) -> f64 {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let share = |top: f64, bottom: f64| if bottom > PARALLEL { (top / bottom).clamp(0.0, 1.0) } else { 0.0 };
    // Nearest points of the lines, clamped to one segment, then each end once more against the other.
    let s = share(uv * vw - vv * uw, uu * vv - uv * uv);
    let t = share(uv * s + vw, vv);
    let s = share(uv * t - uw, uu);
    (w + u * s - v * t).norm()
}

/// Distance of a segment to an axis-aligned box at the origin: convex along the segment, so a golden-section search finds it.
fn segment_to_box_m(from: &Point3<f64>, to: &Point3<f64>, half_m: &Vector3<f64>) -> f64 {
    let at = |t: f64| ((from + (to - from) * t).coords.abs() - half_m).sup(&Vector3::zeros()).norm();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..GOLDEN_ROUNDS {
        let span = (high - low) * GOLDEN;
        if at(high - span) <= at(low + span) { high = low + span } else { low = high - span }
    }
    at((low + high) / 2.0).min(at(0.0)).min(at(1.0))
}

/// Greatest gap along any of the 15 candidate directions of the separating axis theorem.
fn box_separation_m(a: &Isometry3<f64>, h: &Vector3<f64>, b: &Isometry3<f64>, k: &Vector3<f64>) -> f64 {
    let relative = a.inv_mul(b);
    let turn = relative.rotation.to_rotation_matrix();
    let axes = turn.matrix();
    let gap = |direction: &Vector3<f64>| {
        let reach = direction.abs().dot(h) + axes.tr_mul(direction).abs().dot(k);
        direction.dot(&relative.translation.vector).abs() - reach
    };
    let mut best = f64::NEG_INFINITY;
    for i in 0..3 {
        let own = Vector3::ith(i, 1.0);
        best = best.max(gap(&own)).max(gap(&axes.column(i).into_owned()));
        for j in 0..3 {
            let cross = own.cross(&axes.column(j));
            let norm = cross.norm();
            if norm > PARALLEL {
                best = best.max(gap(&(cross / norm)));
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn capsule(from: [f64; 3], to: [f64; 3], radius_m: f64) -> Solid {
        Solid::Capsule { from: from.into(), to: to.into(), radius_m }
    }

    fn cuboid(at: [f64; 3], yaw: f64, half: [f64; 3]) -> Solid {
        Solid::cuboid(Isometry3::from_parts(at.into(), UnitQuaternion::from_euler_angles(0.0, 0.0, yaw)), half)
    }

    #[test]
    fn distances_of_known_arrangements() {
        let cube = cuboid([0.0; 3], 0.0, [1.0; 3]);
        let near = |a: &Solid, b: &Solid, d: f64| {
            assert!((a.distance_m(b) - d).abs() < 1e-3, "{} against {d}", a.distance_m(b));
            assert!((b.distance_m(a) - d).abs() < 1e-3);
        };
        near(&cube, &cuboid([3.0, 0.5, 0.2], 0.0, [1.0; 3]), 1.0);
        near(&cube, &cuboid([4.0, 0.0, 0.0], std::f64::consts::FRAC_PI_4, [1.0; 3]), 3.0 - f64::sqrt(2.0));
        near(&cube, &capsule([3.0, -5.0, 0.0], [3.0, 5.0, 0.0], 0.5), 1.5);
        near(&cube, &capsule([2.0, 2.0, 0.0], [5.0, 5.0, 0.0], 0.5), f64::sqrt(2.0) - 0.5);
        near(&capsule([0.0; 3], [1.0, 0.0, 0.0], 0.1), &capsule([0.5, -1.0, 1.0], [0.5, 1.0, 1.0], 0.2), 0.7);
        near(&capsule([0.0; 3], [1.0, 0.0, 0.0], 0.1), &capsule([2.0, 0.0, 0.0], [3.0, 0.0, 0.0], 0.2), 0.7);
        assert!(cube.distance_m(&cuboid([1.5, 0.0, 0.0], 0.3, [1.0; 3])) < 0.0);
        assert!(!cube.farther_than(&cuboid([2.1, 0.0, 0.0], 0.0, [1.0; 3]), 0.2));
        assert!((cuboid([0.0, 0.0, 3.0], 0.4, [1.0; 3]).lowest_m() - 2.0).abs() < 1e-12);
    }
}
