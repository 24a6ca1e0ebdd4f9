//! What the rows of a task's states and actions hold.

use super::{REST_HEIGHT_M, Task};
use crate::demo::{Demo, Episode, Step};
use crate::layout::{Aim, Chain, Frame, Holds, Layout, Span};
use crate::robot::VELOCITY_LIMITS_RAD_S;
use crate::robot::jaco::TOOL_IN_HAND_M;
use crate::robot::kinematics::Arm;
use crate::state::{ARM_JOINTS, Action, BASE_DIM, CONTROL_DT_S, JOINTS, State, action_names};
use serde_json::{Value, json};
use std::sync::{Arc, LazyLock};

static LAYOUTS: LazyLock<[Arc<Layout>; 3]> = LazyLock::new(|| Task::ALL.map(|task| Arc::new(of(task))));

impl Task {
    /// What its rows hold.
    pub fn layout(self) -> Arc<Layout> {
        Arc::clone(&LAYOUTS[self as usize])
    }
}

impl Episode {
    /// The arrays that learning reads.
    ///
    /// # Errors
    /// See [`Demo::new`].
    pub fn to_demo(&self) -> Result<Demo, String> {
        let states = self.steps.iter().chain([&self.last]).flat_map(|s| s.state.to_row()).collect();
        let rows = |pick: fn(&Step) -> &Action| self.steps.iter().flat_map(|s| pick(s).map(|v| v as f32)).collect::<Vec<f32>>();
        Demo::new(&self.scene.task.layout(), states, rows(|s| &s.commanded), rows(|s| &s.executed))
    }
}

/// The description of a network as this version has it: those of older ones name the task, and leave its layout unsaid.
pub fn with_layout(mut description: Value) -> Value {
    let task = description.get("task").and_then(Value::as_str).and_then(|name| name.parse::<Task>().ok());
    if let (Some(task), None) = (task, description.get("layout")) {
        description["layout"] = json!(*task.layout());
    }
    description
}

fn of(task: Task) -> Layout {
    let (names, commands) = (State::column_names(task), action_names());
    let span = |name: &str, holds, entries: &[String]| Span { name: name.into(), holds, entries: entries.to_vec() };
    let mut state = vec![
        span("q", Holds::JointPositions, &names[..JOINTS]),
        span("dq", Holds::JointVelocities, &names[JOINTS..2 * JOINTS]),
        span("block", Holds::Pose, &names[2 * JOINTS..BASE_DIM]),
    ];
    // A block on the base block is as far above it as two that rest on the table are high.
    let aim = match task {
        Task::PickUp => None,
        Task::PickAndPlace => Some(("goal", Holds::FixedPoint, 0.0)),
        Task::Stack => Some(("base", Holds::FixedPose, 2.0 * REST_HEIGHT_M)),
    };
    state.extend(aim.map(|(name, holds, _)| span(name, holds, &names[BASE_DIM..])));
    let aims = aim.map(|(name, _, up_m)| Aim { object: "block".into(), target: name.into(), offset_m: [0.0, 0.0, up_m] });
    let action = vec![
        span("arm", Holds::ArmVelocities, &commands[..ARM_JOINTS]),
        span("fingers", Holds::FingerVelocities, &commands[ARM_JOINTS..]),
    ];
    Layout {
        name: task.name().into(),
        period_s: CONTROL_DT_S,
        state,
        action,
        action_limits: VELOCITY_LIMITS_RAD_S.to_vec(),
        aims: aims.into_iter().collect(),
        arm: Some(arm()),
    }
}

/// The arm's fixed transforms.
fn arm() -> Chain {
    let arm = Arm::new();
    let frame = |i: usize| {
        let (origin, matrix) = (arm.origin(i), arm.origin(i).rotation.to_rotation_matrix());
        Frame {
            columns: std::array::from_fn(|c| std::array::from_fn(|r| matrix[(r, c)])),
            origin_m: origin.translation.vector.into(),
        }
    };
    Chain { joints: (0..ARM_JOINTS).map(frame).collect(), tool_m: TOOL_IN_HAND_M }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_describes_its_tasks_rows() {
        for task in Task::ALL {
            let layout = task.layout();
            assert_eq!(layout.check(), Ok(()));
            assert_eq!((layout.state_dim(), layout.changing(), layout.action_dim()), (task.state_dim(), BASE_DIM, JOINTS));
            let names: Vec<_> = layout.state.iter().flat_map(|span| &span.entries).cloned().collect();
            assert_eq!(names, State::column_names(task));
        }
    }
}
