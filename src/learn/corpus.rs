//! All demos side by side: transition r of the corpus is (s_t, a_t, s_{t+1}) of one demo, transitions of a demo are consecutive.

use super::dynamics::Dynamics;
use super::policy::Policy;
use crate::demo::{Demo, LARGEST_NUMBER};
use crate::error::{Error, Result};
use crate::state::{BASE_DIM, JOINTS};
use crate::tasks::Task;
use std::ops::Range;

/// Transitions of many demos, row-major.
pub struct Corpus {
    /// The task.
    pub task: Task,
    /// First transition of each demo, and the end of the last.
    pub starts: Vec<usize>,
    /// s_t, `task.state_dim()` wide.
    pub states: Vec<f32>,
    /// The entries of s_{t+1} that change during an episode, [`BASE_DIM`] wide.
    pub next: Vec<f32>,
    /// Commanded actions \[rad/s\].
    pub commanded: Vec<f32>,
    /// Executed actions \[rad/s\].
    pub executed: Vec<f32>,
}

/// Inputs and targets of a network, computed once.
pub struct Samples {
    /// Rows of the network's input width.
    pub inputs: Vec<f32>,
    /// Rows of its output width.
    pub targets: Vec<f32>,
}

impl Corpus {
    /// Collects `demos`; `what` names them in errors ("training", "validation").
    ///
    /// # Errors
    /// [`Error::Failed`] when there is no demo, tasks are mixed, or a number is beyond all measure: losses would be none.
    pub fn new(demos: &[Demo], what: &str) -> Result<Self> {
        let Some(first) = demos.first() else {
            return Err(Error::Failed(format!("there is no {what} demo: record more episodes, or look at why all failed")));
        };
        let task = first.task();
        if let Some(other) = demos.iter().find(|d| d.task() != task) {
            return Err(Error::Failed(format!("{what} demos of {task} and {} are mixed; give one task's", other.task())));
        }
        let mut corpus = Corpus { task, starts: vec![0], states: vec![], next: vec![], commanded: vec![], executed: vec![] };
        for (number, demo) in demos.iter().enumerate() {
            plausible(demo).map_err(|why| Error::Failed(format!("{what} demo {number}: {why}")))?;
            for t in 0..demo.len() {
                corpus.states.extend_from_slice(demo.state(t));
                corpus.next.extend_from_slice(&demo.state(t + 1)[..BASE_DIM]);
            }
            corpus.commanded.extend_from_slice(demo.actions());
            corpus.executed.extend_from_slice(demo.executed());
            corpus.starts.push(corpus.commanded.len() / JOINTS);
        }
        Ok(corpus)
    }

    /// Number of transitions.
    pub fn rows(&self) -> usize {
        self.commanded.len() / JOINTS
    }

    /// Number of demos.
    pub fn demos(&self) -> usize {
        self.starts.len() - 1
    }

    /// Transitions of a demo.
    pub fn demo(&self, i: usize) -> Range<usize> {
        self.starts[i]..self.starts[i + 1]
    }

    /// Transitions of the longest demo.
    pub fn longest(&self) -> usize {
        (0..self.demos()).map(|i| self.demo(i).len()).max().unwrap_or(0)
    }

    /// Transitions of some demos, one after another, into `rows`.
    pub fn rows_of(&self, demos: &[usize], rows: &mut Vec<usize>) {
        rows.clear();
        rows.reserve(demos.len() * self.longest());
        rows.extend(demos.iter().flat_map(|i| self.demo(*i)));
    }

    /// s_t of transition `r`.
    pub fn state(&self, r: usize) -> &[f32] {
        row(&self.states, self.task.state_dim(), r)
    }

    /// What behavior cloning learns: the policy's inputs and the standardised commanded actions.
    pub fn policy_samples(&self, policy: &Policy) -> Samples {
        let (features, width) = (policy.features(), policy.features().width());
        let mut inputs = Vec::with_capacity(self.rows() * width);
        features.for_each(&self.states, |row| inputs.extend_from_slice(row));
        let scaling = policy.action_scaling();
        let targets = self.commanded.iter().enumerate().map(|(i, a)| scaling.apply(i % JOINTS, *a)).collect();
        Samples { inputs, targets }
    }

    /// What the dynamics network learns from the observed transitions: its inputs, and what it must add, standardised.
    pub fn model_samples(&self, dynamics: &Dynamics) -> Samples {
        let width = dynamics.inputs();
        let (mut inputs, mut targets) = (Vec::with_capacity(self.rows() * width), vec![0.0; self.rows() * BASE_DIM]);
        dynamics.features().for_each(&self.states, |seen| {
            let action = row(&self.executed, JOINTS, inputs.len() / width);
            inputs.extend_from_slice(seen);
            inputs.extend(action.iter().enumerate().map(|(i, a)| dynamics.action_scaling().apply(i, *a)));
        });
        for r in 0..self.rows() {
            let (state, action) = (self.state(r), row(&self.executed, JOINTS, r));
            let target = &mut targets[r * BASE_DIM..(r + 1) * BASE_DIM];
            dynamics.residual_target(state, action, row(&self.next, BASE_DIM, r), target);
        }
        Samples { inputs, targets }
    }
}

/// Names the first number that is beyond [`LARGEST_NUMBER`].
fn plausible(demo: &Demo) -> std::result::Result<(), String> {
    let dim = demo.task().state_dim();
    let arrays =
        [("state", demo.states(), dim), ("action", demo.actions(), JOINTS), ("executed action", demo.executed(), JOINTS)];
    for (name, values, width) in arrays {
        if let Some(at) = values.iter().position(|v| f64::from(v.abs()) > LARGEST_NUMBER) {
            let (step, entry, value) = (at / width, at % width, values[at]);
            return Err(format!(
                "{name} of step {step}, entry {entry} is {value:e}; none can be larger than {LARGEST_NUMBER:e} (rad, rad/s, m): \
                 record the episode again or leave it out"
            ));
        }
    }
    Ok(())
}

/// Row `r` of a row-major array.
#[inline]
pub fn row(array: &[f32], width: usize, r: usize) -> &[f32] {
    &array[r * width..(r + 1) * width]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::testing::demo;

    #[test]
    fn refuses_no_demos_and_mixed_tasks() {
        let message = |demos: &[Demo]| Corpus::new(demos, "training").err().expect("refused").to_string();
        assert!(message(&[]).contains("no training demo"));
        let mixed = [demo(Task::Stack, 5, 0), demo(Task::PickUp, 5, 0)];
        assert!(message(&mixed).contains("pick-up"));
    }

    #[test]
    fn transitions_are_those_of_the_demos() {
        let demos = [demo(Task::Stack, 5, 0), demo(Task::Stack, 3, 1)];
        let corpus = Corpus::new(&demos, "training").expect("demos");
        assert_eq!((corpus.rows(), corpus.demo(1)), (8, 5..8));
        assert_eq!(corpus.state(6), demos[1].state(1));
        assert_eq!(row(&corpus.next, BASE_DIM, 7), &demos[1].state(3)[..BASE_DIM]);
    }

    #[test]
    fn a_number_beyond_all_measure_is_named_before_it_makes_a_loss_none() {
        let like = demo(Task::PickUp, 5, 0);
        let mut states = like.states().to_vec();
        states[2 * Task::PickUp.state_dim() + 3] = 3e38;
        let huge = Demo::new(Task::PickUp, states, like.actions().to_vec(), like.executed().to_vec()).expect("finite");
        let said = Corpus::new(&[like, huge], "validation").err().expect("refused").to_string();
        assert!(said.contains("validation demo 1: state of step 2, entry 3 is 3e38"), "{said}");
    }
}
