//! Trajectories: an executed [`Episode`] with all that was recorded, and a [`Demo`], the arrays that learning reads.

use crate::joints::Joints;
use crate::layout::Layout;
use crate::scene::Scene;
use crate::state::{Action, Pose, State};
use crate::task::FailureClass;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;

/// No angle \[rad\], position \[m\], velocity \[rad/s, m/s\] or command of this world is larger: what is comes from a simulation that broke down
/// or from a damaged file, and its square may be more than single precision holds.
pub const LARGEST_NUMBER: f64 = 1e6;

/// Which part of a plan the demonstrator follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// From the ready pose to the grasp, fingers open.
    Approach,
    /// Fingers close, arm still.
    Close,
    /// Lift, carry and lower with the object in the hand.
    Carry,
    /// Fingers open, arm still.
    Open,
    /// Straight up and away from the released object.
    Retreat,
}

impl Phase {
    /// All phases in order; the position is the code used in files.
    pub const ALL: [Phase; 5] = [Phase::Approach, Phase::Close, Phase::Carry, Phase::Open, Phase::Retreat];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        ["approach", "close", "carry", "open", "retreat"][self as usize]
    }
}

/// What touches an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Touch {
    /// Normal force between each finger and the object \[N\].
    pub fingers_n: Joints,
    /// Whether it touches the table.
    pub table: bool,
    /// Which other objects it touches, by their places in the task.
    pub objects: BTreeSet<usize>,
}

/// What touches what.
#[derive(Clone, Debug, PartialEq)]
pub struct Contacts {
    /// Of each object of the task.
    pub objects: Vec<Touch>,
    /// Whether any robot link touches an obstacle.
    pub robot_obstacle: bool,
    /// Whether any robot link touches the table.
    pub robot_table: bool,
}

impl Contacts {
    /// Nothing touches anything, of a hand with so many fingers and so many objects.
    pub fn none(fingers: usize, objects: usize) -> Self {
        let untouched = Touch { fingers_n: Joints::zeros(fingers), table: false, objects: BTreeSet::new() };
        Contacts { objects: vec![untouched; objects], robot_obstacle: false, robot_table: false }
    }
}

/// An object now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Where it is; one that no goal moves may have been pushed.
    pub pose: Pose,
    /// Speed of its centre \[m/s\].
    pub speed_m_s: f64,
}

/// One control step: the state before it, the action taken in it, and what held in that state.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// s_t.
    pub state: State,
    /// The task's objects.
    pub objects: Vec<Body>,
    /// What the controller asked for \[rad/s, m/s\].
    pub commanded: Action,
    /// What the motors were given: commanded + noise + pulse, clamped to the joint velocity limits \[rad/s, m/s\].
    pub executed: Action,
    /// Contacts in s_t.
    pub contacts: Contacts,
    /// Reward earned in this step (each milestone once per episode).
    pub reward: f64,
    /// Which of `task.condition_names()` hold in s_t, in that order.
    pub conditions: Vec<bool>,
    /// The demonstrator's phase; `None` under a learned policy.
    pub phase: Option<Phase>,
}

/// An executed episode: T steps and the state after the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Episode {
    /// Episode number within its run (also its random stream).
    pub index: u64,
    /// The scene it started in.
    pub scene: Scene,
    /// T steps.
    pub steps: Vec<Step>,
    /// s_{T+1}, with conditions and contacts; its actions are zero.
    pub last: Step,
    /// Whether the task was solved.
    pub success: bool,
    /// Why not, if it was not.
    pub failure: Option<FailureClass>,
}

impl Episode {
    /// Every moment: before each step, and the last.
    pub fn moments(&self) -> impl Iterator<Item = &Step> {
        self.steps.iter().chain([&self.last])
    }
}

/// d = <(s_t^E, a_t^E)>: one demo trajectory, T + 1 states and T actions, row-major f32.
///
/// ```
/// use hilt::demo::Demo;
/// use hilt::robot::file::built_in::paper_robot;
/// use hilt::task::built_in::stack;
/// use std::sync::Arc;
///
/// let layout = Arc::new(stack().layout(&paper_robot()));
/// let (d, a) = (layout.state_dim(), layout.action_dim());
/// // Three actions, and the states before and after each.
/// let demo = Demo::new(&layout, vec![0.0; 4 * d], vec![0.1; 3 * a], vec![0.1; 3 * a])?;
/// assert_eq!((demo.len(), demo.action(2).len()), (3, 9));
/// let refused = Demo::new(&layout, vec![0.0; 3 * d], vec![0.1; 3 * a], vec![0.1; 3 * a]);
/// assert!(refused.unwrap_err().contains("3 actions need 128 state numbers"));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Demo {
    layout: Arc<Layout>,
    state_dim: usize,
    action_dim: usize,
    states: Vec<f32>,
    actions: Vec<f32>,
    executed: Vec<f32>,
}

impl Demo {
    /// Checks and wraps the arrays: `states` (T+1) x D, `actions` (commanded) and `executed` T x A, in the units of the
    /// layout.
    ///
    /// # Errors
    /// Says which length or value is wrong: T = 0, rows that do not fit, or a number that is not finite.
    pub fn new(layout: &Arc<Layout>, states: Vec<f32>, actions: Vec<f32>, executed: Vec<f32>) -> Result<Self, String> {
        let (dim, action_dim) = (layout.state_dim(), layout.action_dim());
        let steps = actions.len() / action_dim;
        if steps == 0 || actions.len() != steps * action_dim {
            return Err(format!("a demo needs T x {action_dim} actions with T >= 1, got {} numbers", actions.len()));
        }
        if executed.len() != actions.len() {
            return Err(format!("{} executed against {} commanded action numbers", executed.len(), actions.len()));
        }
        if states.len() != (steps + 1) * dim {
            return Err(format!(
                "{} has states of {dim} numbers, so {steps} actions need {} state numbers, got {}",
                layout.name,
                (steps + 1) * dim,
                states.len()
            ));
        }
        for (name, values, width) in
            [("state", &states, dim), ("action", &actions, action_dim), ("executed action", &executed, action_dim)]
        {
            if let Some(at) = values.iter().position(|v| !v.is_finite()) {
                return Err(format!(
                    "{name} of step {}, entry {} is {}, not a finite number",
                    at / width,
                    at % width,
                    values[at]
                ));
            }
        }
        Ok(Demo { layout: Arc::clone(layout), state_dim: dim, action_dim, states, actions, executed })
    }

    /// What its rows hold.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// Number of actions T.
    #[allow(clippy::len_without_is_empty, reason = "a demo is never empty")]
    pub fn len(&self) -> usize {
        self.actions.len() / self.action_dim
    }

    /// All states, (T+1) x D row-major.
    pub fn states(&self) -> &[f32] {
        &self.states
    }

    /// Commanded actions, T x A row-major: the labels of behavior cloning.
    pub fn actions(&self) -> &[f32] {
        &self.actions
    }

    /// Executed actions, T x A row-major: the inputs of the dynamics network.
    pub fn executed(&self) -> &[f32] {
        &self.executed
    }

    /// Commanded action t (0-based).
    pub fn action(&self, t: usize) -> &[f32] {
        &self.actions[t * self.action_dim..(t + 1) * self.action_dim]
    }

    /// Executed action t (0-based).
    pub fn executed_action(&self, t: usize) -> &[f32] {
        &self.executed[t * self.action_dim..(t + 1) * self.action_dim]
    }

    /// State t (0-based).
    pub fn state(&self, t: usize) -> &[f32] {
        &self.states[t * self.state_dim..(t + 1) * self.state_dim]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{Holds, Span};

    #[test]
    fn a_demo_refuses_wrong_lengths_and_nan() {
        let span = |holds, n| Span { name: "x".into(), holds, entries: vec!["x".into(); n] };
        let (d, a, t) = (5, 2, 3);
        let (state, action) = (vec![span(Holds::Numbers, d)], vec![span(Holds::Commands, a)]);
        let layout = Layout {
            name: "toy".into(),
            period_s: 0.1,
            state,
            action,
            action_limits: vec![],
            action_units: vec![],
            aims: vec![],
            arm: None,
        };
        let layout = Arc::new(layout);
        let make = |states: usize, actions: usize| Demo::new(&layout, vec![0.0; states], vec![0.0; actions], vec![0.0; actions]);
        assert_eq!(make((t + 1) * d, t * a).expect("fits").len(), t);
        assert!(make(t * d, t * a).is_err());
        assert!(make(d, 0).is_err());
        assert!(make((t + 1) * d, t * a + 1).is_err());
        let mut states = vec![0.0; (t + 1) * d];
        states[d + 2] = f32::NAN;
        let message = Demo::new(&layout, states, vec![0.0; t * a], vec![0.0; t * a]).unwrap_err();
        assert!(message.contains("step 1, entry 2"), "{message}");
    }
}
