//! Toy demos for tests, of a robot that nobody has: an arm of five joints with two fingers, without friction, whose joints turn towards angles
//! that depend on the block, with noise on the commands.

use crate::demo::Demo;
use crate::layout::{Aim, Chain, Frame, Holds, Layout, POINT_DIM, POSE_DIM, Span};
use crate::seed::stream;
use rand::{Rng, RngExt};
use std::sync::Arc;

/// Joints of the arm.
pub const ARM_JOINTS: usize = 5;
/// Fingers.
pub const FINGERS: usize = 2;
/// Both.
pub const JOINTS: usize = ARM_JOINTS + FINGERS;
/// Entries of a state with one block that may change.
pub const BASE_DIM: usize = 2 * JOINTS + POSE_DIM;
/// Control period \[s\].
const DT_S: f32 = 0.05;
/// The block's first entry.
const BLOCK: usize = 2 * JOINTS;
/// Where the joints turn about \[rad\].
const MIDDLE_RAD: [f32; JOINTS] = [0.2, 1.1, -0.9, 0.7, -0.3, 0.1, 0.15];

/// Kinds of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Toy {
    /// A block.
    PickUp,
    /// A block and its goal.
    PickAndPlace,
    /// A block and one that it is put on.
    Stack,
    /// Two blocks, one of which is put on the other, which goes to a goal.
    Tower,
}

impl Toy {
    /// What its rows hold.
    pub fn layout(self) -> Arc<Layout> {
        let span =
            |name: &str, holds, n| Span { name: name.into(), holds, entries: (0..n).map(|i| format!("{name}.{i}")).collect() };
        let aim =
            |object: &str, target: &str, up_m| Aim { object: object.into(), target: target.into(), offset_m: [0.0, 0.0, up_m] };
        let mut state = vec![
            span("q", Holds::JointPositions, JOINTS),
            span("dq", Holds::JointVelocities, JOINTS),
            span("block", Holds::Pose, POSE_DIM),
        ];
        let mut aims = Vec::new();
        if self == Toy::Tower {
            state.push(span("other", Holds::Pose, POSE_DIM));
            aims.push(aim("block", "other", 0.05));
        }
        match self {
            Toy::PickUp => {}
            Toy::PickAndPlace => state.push(span("goal", Holds::FixedPoint, POINT_DIM)),
            Toy::Stack => state.push(span("goal", Holds::FixedPose, POSE_DIM)),
            Toy::Tower => state.push(span("goal", Holds::FixedPoint, POINT_DIM)),
        }
        match self {
            Toy::PickUp => {}
            Toy::PickAndPlace => aims.push(aim("block", "goal", 0.0)),
            Toy::Stack => aims.push(aim("block", "goal", 0.05)),
            Toy::Tower => aims.push(aim("other", "goal", 0.0)),
        }
        let action = vec![span("arm", Holds::ArmVelocities, ARM_JOINTS), span("fingers", Holds::FingerVelocities, FINGERS)];
        let layout = Layout {
            name: format!("{self:?}"),
            period_s: f64::from(DT_S),
            state,
            action,
            action_limits: vec![0.8; JOINTS],
            action_units: Vec::new(),
            aims,
            arm: Some(arm()),
        };
        layout.check().expect("a sound layout");
        Arc::new(layout)
    }
}

/// Five joints in turn about the vertical and across.
fn arm() -> Chain {
    let along = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let across = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]; // a quarter turn about x
    let back = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    let frame = |columns, origin_m| Frame { columns, origin_m };
    let joints = vec![
        frame(along, [0.0, 0.0, 0.2]),
        frame(across, [0.05, 0.0, 0.1]),
        frame(along, [0.3, 0.0, 0.0]),
        frame(along, [0.25, 0.02, 0.0]),
        frame(back, [0.1, 0.0, 0.0]),
    ];
    Chain { joints, tool_m: [0.0, 0.01, 0.12] }
}

fn noise(rng: &mut impl Rng, size: f32) -> f32 {
    size * (2.0 * rng.random::<f32>() - 1.0)
}

fn first_state(layout: &Layout, rng: &mut impl Rng) -> Vec<f32> {
    let mut state = vec![0.0f32; layout.state_dim()];
    (0..JOINTS).for_each(|i| state[i] = MIDDLE_RAD[i] + noise(rng, 0.05));
    let (mut at, rest) = (BLOCK, layout.state_spans().skip(2));
    for (span, _) in rest {
        let pose = [0.47 + noise(rng, 0.15), noise(rng, 0.15), 0.025, noise(rng, 0.01), noise(rng, 0.01), 0.0, 1.0];
        let n = span.entries.len();
        state[at..at + n].copy_from_slice(&pose[..n]);
        at += n;
    }
    state
}

/// `rows` states around the start, with random velocities.
pub fn random_states(toy: Toy, rows: usize, seed: u64) -> Vec<f32> {
    let (mut rng, layout) = (stream(seed, "toy-states", 0), toy.layout());
    let mut states = Vec::new();
    for _ in 0..rows {
        let mut state = first_state(&layout, &mut rng);
        (JOINTS..2 * JOINTS).for_each(|i| state[i] = noise(&mut rng, 0.5));
        states.extend(state);
    }
    states
}

/// One toy demo of `steps` actions.
pub fn demo(toy: Toy, steps: usize, seed: u64) -> Demo {
    let (mut rng, layout) = (stream(seed, "toy-demo", 0), toy.layout());
    let mut state = first_state(&layout, &mut rng);
    let (mut states, mut actions, mut executed) = (state.clone(), Vec::new(), Vec::new());
    for _ in 0..steps {
        for i in 0..JOINTS {
            let target = MIDDLE_RAD[i] + 0.8 * state[BLOCK + i % 2] - 0.2;
            let command = (2.0 * (target - state[i])).clamp(-0.6, 0.6);
            let given = command + noise(&mut rng, 0.05);
            actions.push(command);
            executed.push(given);
            state[i] += DT_S * given;
            state[JOINTS + i] = given;
        }
        state[BLOCK] += 0.002 * state[JOINTS];
        states.extend(&state);
    }
    Demo::new(&layout, states, actions, executed).expect("a toy demo has matching lengths")
}

/// `count` toy demos of slightly different lengths.
pub fn demos(toy: Toy, count: usize, steps: usize, seed: u64) -> Vec<Demo> {
    (0..count).map(|i| demo(toy, steps + i % 3, seed + i as u64)).collect()
}
