//! What the rows of a robot's states and actions in a task hold.

use super::Task;
use crate::demo::{Demo, Episode, Step};
use crate::layout::{Aim, Chain, Frame, Holds, Layout, Span};
use crate::robot::Robot;
use crate::robot::file::built_in::paper_robot;
use crate::robot::model::Joint;
use crate::state::{Action, CONTROL_DT_S};
use crate::task::{Goal, Target, built_in};
use nalgebra::Isometry3;
use serde_json::{Value, json};
use std::ops::Range;
use std::sync::Arc;

/// Names of the entries of a pose and of a point, after their body's.
const POSE: [&str; 7] = ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"];

impl Task {
    /// What the rows of this robot in this task hold.
    pub fn layout(&self, robot: &Robot) -> Arc<Layout> {
        Arc::new(layout(self, robot))
    }
}

impl Episode {
    /// The arrays that learning reads.
    ///
    /// # Errors
    /// See [`Demo::new`].
    pub fn to_demo(&self) -> Result<Demo, String> {
        let states = self.steps.iter().chain([&self.last]).flat_map(|s| s.state.to_row()).collect();
        let rows =
            |pick: fn(&Step) -> &Action| self.steps.iter().flat_map(|s| pick(s).iter().map(|v| *v as f32)).collect::<Vec<f32>>();
        Demo::new(&self.scene.task.layout(&self.scene.robot), states, rows(|s| &s.commanded), rows(|s| &s.executed))
    }
}

/// The description of a network as this version has it: those of older ones name the task, and leave its layout unsaid, which is that of the paper's robot.
pub fn with_layout(mut description: Value) -> Value {
    let task = description.get("task").and_then(Value::as_str).and_then(|name| built_in::find(name).ok());
    if let (Some(task), None) = (task, description.get("layout")) {
        description["layout"] = json!(*task.layout(&paper_robot()));
    }
    description
}

fn layout(task: &Task, robot: &Robot) -> Layout {
    // `q_rad` of joints that turn, `q_m` of those that slide.
    let of_joints = |name: &str, holds, entry: fn(&Joint) -> String, which: Range<usize>| Span {
        name: name.into(),
        holds,
        entries: robot.joints[which].iter().map(entry).collect(),
    };
    let of_body = |name: &str, holds, parts: &[&str]| Span {
        name: name.into(),
        holds,
        entries: parts.iter().map(|part| format!("{name}.{part}")).collect(),
    };
    let all = 0..robot.joints.len();
    let mut state = vec![
        of_joints("q", Holds::JointPositions, Joint::position_name, all.clone()),
        of_joints("dq", Holds::JointVelocities, Joint::velocity_name, all),
    ];
    for (i, object) in task.objects.iter().enumerate() {
        let holds = if i < task.moved() { Holds::Pose } else { Holds::FixedPose };
        state.push(of_body(&object.name, holds, &POSE));
    }
    let goals = task.goal_names();
    state.extend(goals.iter().map(|name| of_body(name, Holds::FixedPoint, &POSE[..3])));
    let aim = |(k, goal): (usize, &Goal)| {
        let (object, other) = (&task.objects[goal.object], |i: usize| &task.objects[i]);
        let (target, up_m) = match &goal.target {
            Target::Lift { .. } => return None,
            Target::At { .. } => (&goals[task.place_number(k)?], 0.0),
            // Centre on centre, the two halves apart.
            Target::On(base) => (&other(*base).name, other(*base).rest_m() + object.rest_m()),
            Target::In(bin) => (&other(*bin).name, object.rest_m() - other(*bin).rest_m()),
        };
        Some(Aim { object: object.name.clone(), target: target.clone(), offset_m: [0.0, 0.0, up_m] })
    };
    let aims = task.goals.iter().enumerate().filter_map(aim).collect();
    let closing = |i: usize| robot.closing_way(i).signum();
    let sign = |i: usize| if i < robot.arm { 1.0 } else { closing(i - robot.arm) };
    let units: Vec<f64> = robot.joints.iter().enumerate().map(|(i, joint)| joint.per_radian() * sign(i)).collect();
    Layout {
        name: task.name.clone(),
        period_s: CONTROL_DT_S,
        state,
        action: vec![
            of_joints("arm", Holds::ArmVelocities, Joint::command_name, 0..robot.arm),
            of_joints("fingers", Holds::FingerVelocities, Joint::command_name, robot.fingers()),
        ],
        action_limits: robot.joints.iter().map(|joint| joint.velocity).collect(),
        action_units: if units.iter().all(|unit| *unit == 1.0) { Vec::new() } else { units },
        aims,
        arm: Some(arm(robot)),
    }
}

/// The arm's fixed transforms.
fn arm(robot: &Robot) -> Chain {
    let frame = |at: &Isometry3<f64>| {
        let matrix = at.rotation.to_rotation_matrix();
        Frame {
            columns: std::array::from_fn(|c| std::array::from_fn(|r| matrix[(r, c)])),
            origin_m: at.translation.vector.into(),
        }
    };
    Chain { joints: robot.joints[..robot.arm].iter().map(|joint| frame(&joint.origin)).collect(), tool_m: robot.tool_m }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::named;
    use crate::task::built_in::{pick_and_place, pick_up, stack};

    #[test]
    fn a_layout_describes_the_rows_of_its_robot() {
        let panda = named("panda").expect("it is there").expect("it is sound");
        for (robot, joints) in [(&*paper_robot(), 9), (&panda, 9)] {
            for (task, more) in [(pick_up(), 0), (pick_and_place(), 3), (stack(), 7)] {
                let layout = task.layout(robot);
                assert_eq!(layout.check(), Ok(()));
                let dims = (layout.state_dim(), layout.changing(), layout.action_dim());
                assert_eq!(dims, (2 * joints + 7 + more, 2 * joints + 7, joints));
            }
        }
        let layout = stack().layout(&panda);
        let names = |at: usize| layout.state.iter().flat_map(|span| &span.entries).nth(at).cloned();
        assert_eq!(names(0).as_deref(), Some("panda_joint1.q_rad"));
        assert_eq!(names(8).as_deref(), Some("panda_finger_joint2.q_m"));
        assert_eq!(names(17).as_deref(), Some("panda_finger_joint2.dq_m_s"));
        assert_eq!(layout.action[1].entries[1], "panda_finger_joint2.velocity_m_s");
    }
}
