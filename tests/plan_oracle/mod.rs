//! An independent look at a plan's clearances: parry's shapes and distances.

use hilt::demo::Phase;
use hilt::joints::Joints;
use hilt::plan::{Plan, RESOLUTION_M};
use hilt::robot::Robot;
use hilt::robot::model::Shape;
use hilt::scene::Scene;
use nalgebra::Isometry3;
use rapier3d::math::{Pose, Vector};
use rapier3d::parry::query;
use rapier3d::parry::shape::{Capsule, Cuboid, SharedShape};
use std::sync::Arc;

/// Half of the block's edges \[m\].
const HALF_M: [f64; 3] = [0.025; 3];
/// Single precision of the oracle \[m\].
const PRECISION_M: f64 = 5e-4;
/// The support may be touched this near to grasp and release: sideways, upward \[m\].
const ZONE_M: [f64; 2] = [0.02, 0.06];
/// Hand and fingers work this near to the table \[m\].
const HAND_TABLE_M: f64 = 0.001;

/// What stands in a scene, as parry sees it.
pub struct Oracle {
    robot: Arc<Robot>,
    obstacles: Vec<(Pose, SharedShape)>,
    base: Option<(Pose, SharedShape)>,
    table: (Pose, SharedShape),
}

impl Oracle {
    pub fn new(scene: &Scene) -> Self {
        let cuboid = |half: [f64; 3]| SharedShape::new(Cuboid::new(vector(half)));
        let place = |at: [f64; 3]| pose(&Isometry3::translation(at[0], at[1], at[2]));
        Oracle {
            robot: Arc::clone(&scene.robot),
            obstacles: scene.obstacles.iter().map(|o| (place(o.center_m), cuboid(o.size_m.map(|s| s / 2.0)))).collect(),
            base: scene.objects.get(1).map(|base| (pose(&base.pose.isometry()), cuboid(HALF_M))),
            table: (place([0.0, 0.0, -0.5]), cuboid([2.0, 2.0, 0.5])),
        }
    }

    /// Panics where the arm or the carried block comes nearer than `clearance_m` to anything, between samples too.
    pub fn check(&self, plan: &Plan, clearance_m: f64) {
        let grasp = plan.waypoints.iter().rev().find(|w| w.phase == Phase::Approach).expect("an approach").q;
        let held = self.robot.tool_pose(&grasp).inverse() * plan.scene.objects[0].pose.isometry();
        for pair in plan.waypoints.windows(2) {
            let (from, to) = (&pair[0].q, &pair[1].q);
            let way = (self.robot.tool_pose(to).translation.vector - self.robot.tool_pose(from).translation.vector).norm();
            let pieces = (way / RESOLUTION_M).ceil().max(1.0) as usize;
            for k in 1..=pieces {
                let share = k as f64 / pieces as f64;
                let q = Joints::from_fn(from.len(), |j| from[j] + share * (to[j] - from[j]));
                self.check_pose(plan, &q, (pair[1].phase == Phase::Carry).then_some(&held), clearance_m);
            }
        }
    }

    fn check_pose(&self, plan: &Plan, q: &Joints, held: Option<&Isometry3<f64>>, clearance_m: f64) {
        let poses = self.robot.link_poses(q);
        let tool = self.robot.tool_of(&poses);
        let near = |[x, y, z]: [f64; 3]| {
            let at = tool.translation.vector;
            hilt::math::hypot(at.x - x, at.y - y) < ZONE_M[0] && at.z - z < ZONE_M[1]
        };
        let releasing = near(plan.scene.target_m(0));
        let moving = self.robot.links.iter().enumerate().skip(1);
        for (link, primitive) in moving.flat_map(|(link, l)| l.shapes.iter().map(move |shape| (link, shape))) {
            let solid = shape(primitive, &poses[link]);
            let hand = link >= self.robot.hand();
            let (table, base) =
                (if hand { HAND_TABLE_M } else { clearance_m }, if hand && releasing { HAND_TABLE_M } else { clearance_m });
            self.check_solid(&solid, &self.robot.links[link].name, [table, base, clearance_m]);
        }
        if let Some(held) = held {
            let solid = (pose(&(tool * held)), SharedShape::new(Cuboid::new(vector(HALF_M))));
            let supported = releasing || near(plan.scene.objects[0].pose.position_m);
            let support = if supported { f64::NEG_INFINITY } else { clearance_m };
            self.check_solid(&solid, "carried block", [support, support, clearance_m]);
        }
    }

    /// Distances to table, base block and obstacles.
    fn check_solid(&self, solid: &(Pose, SharedShape), name: &str, [table, base, obstacle]: [f64; 3]) {
        let check = |(at, other): &(Pose, SharedShape), least: f64, what: &str| {
            if least.is_finite() {
                let distance =
                    query::distance(&solid.0, &*solid.1, at, &**other).expect("parry measures boxes and capsules").distance;
                assert!(f64::from(distance) >= least - PRECISION_M, "{name} is {distance} m from {what}");
            }
        };
        check(&self.table, table, "the table");
        self.base.iter().for_each(|b| check(b, base, "the base block"));
        self.obstacles.iter().for_each(|o| check(o, obstacle, "an obstacle"));
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vector {
    Vector::new(x as f32, y as f32, z as f32)
}

fn pose(iso: &Isometry3<f64>) -> Pose {
    let t = iso.translation.vector;
    Pose::new(vector(t.into()), vector(iso.rotation.scaled_axis().into()))
}

fn shape(shape: &Shape, link: &Isometry3<f64>) -> (Pose, SharedShape) {
    match shape {
        Shape::Capsule { from_m, to_m, radius_m } => {
            (pose(link), SharedShape::new(Capsule::new(vector(*from_m), vector(*to_m), *radius_m as f32)))
        }
        Shape::Box { pose: at, half_m } => (pose(&(link * at)), SharedShape::new(Cuboid::new(vector(*half_m)))),
    }
}
