//! Segments of Algorithm 3 advancing together, and the gradient back through time: policy, features and dynamics network.
//!
//! Segments are sorted by length, longest first, so that at depth j the first `counts[j]` of them are still under way. The rows of all
//! depths lie one after another; depth 0 has no row in the policy's pass, because behavior cloning has done that pass.

use super::corpus::row;
use super::dynamics::{DT_S, Dynamics};
use super::hand::Hand;
use super::policy::Policy;
use super::state_cloning::{Batch, Choices, Segment};
use crate::config::{ActionChoice, Structure};
use crate::nn::Pass;
use crate::state::{BASE_DIM, JOINTS};

/// The workspace of one shard.
#[derive(Default)]
pub struct Rollout {
    segments: Vec<Segment>,
    /// Segments under way at each depth.
    counts: Vec<usize>,
    policy: Pass,
    model: Pass,
    /// States at depth 1 and beyond, one after another.
    states: Vec<f32>,
    hands: Vec<Hand>,
    /// Actions at the current depth, one row a segment \[rad/s\].
    actions: Vec<f32>,
    /// Predictions at all depths.
    predictions: Vec<f32>,
    /// Gradient with respect to the states at the current depth, one row a segment.
    d_states: Vec<f32>,
    /// Gradient with respect to each segment's first mean action.
    d_first: Vec<f32>,
    /// Gradient with respect to the policy's parameters, first actions left out.
    pub gradient: Vec<f32>,
    /// Gradient with respect to the log standard deviations.
    pub d_log_std: [f32; JOINTS],
    /// This shard's part of L_SC.
    pub loss: f64,
}

/// Where the rows of one depth lie.
#[derive(Clone, Copy)]
struct Depth {
    j: usize,
    /// First row in the dynamics network's pass.
    from: usize,
    /// First row in the policy's pass, for j > 0.
    later: usize,
    count: usize,
    next_count: usize,
}

impl Rollout {
    /// Takes in segments, sorted by length, longest first.
    pub fn deal<'a>(&mut self, segments: impl Iterator<Item = &'a Segment>) {
        self.segments.clear();
        self.segments.extend(segments);
        self.counts.clear();
        self.counts.resize(self.segments.first().map_or(0, |s| s.steps), 0);
        for segment in &self.segments {
            self.counts[..segment.steps].iter_mut().for_each(|c| *c += 1);
        }
    }

    fn depth(&self, j: usize) -> Depth {
        let from = self.counts[..j].iter().sum();
        let next_count = self.counts.get(j + 1).copied().unwrap_or(0);
        Depth { j, from, later: from - if j > 0 { self.counts[0] } else { 0 }, count: self.counts[j], next_count }
    }

    /// Loss and gradient of the segments.
    pub fn run(&mut self, policy: &Policy, dynamics: &Dynamics, batch: Batch, choices: &Choices) {
        let (rows, first) = (self.counts.iter().sum::<usize>(), self.segments.len());
        let dim = batch.corpus.task.state_dim();
        self.policy.reserve(&policy.net, rows - first);
        self.model.reserve(&dynamics.net, rows);
        self.states.resize((rows - first) * dim, 0.0);
        self.hands.resize(rows - first, Hand::default());
        self.predictions.resize(rows * BASE_DIM, 0.0);
        self.actions.resize(first * JOINTS, 0.0);
        self.d_first.resize(first * JOINTS, 0.0);
        self.d_states.clear();
        self.d_states.resize(first * BASE_DIM, 0.0);
        self.gradient.clear();
        self.gradient.resize(policy.net.params().len(), 0.0);
        self.d_log_std = [0.0; JOINTS];
        self.loss = 0.0;
        for j in 0..self.counts.len() {
            self.advance(self.depth(j), policy, dynamics, batch, choices);
        }
        for j in (0..self.counts.len()).rev() {
            self.retrace(self.depth(j), policy, dynamics, batch, choices);
        }
        policy.net.add_gradient(&self.policy, 0..rows - first, &mut self.gradient);
    }

    /// One step forward: a_t from the policy, s_{t+1} from the dynamics network.
    fn advance(&mut self, depth: Depth, policy: &Policy, dynamics: &Dynamics, batch: Batch, choices: &Choices) {
        let Depth { j, from, later, count, .. } = depth;
        let dim = batch.corpus.task.state_dim();
        let (width, seen) = (policy.net.inputs(), dynamics.features().width());
        if j > 0 {
            for i in 0..count {
                let (state, hand) = (row(&self.states, dim, later + i), &self.hands[later + i]);
                policy.features().forward(state, hand, &mut self.policy.input[(later + i) * width..(later + i + 1) * width]);
                let at = (from + i) * dynamics.inputs();
                dynamics.features().forward(state, hand, &mut self.model.input[at..at + seen]);
            }
            policy.net.forward(&mut self.policy, later..later + count);
        }
        for i in 0..count {
            let action = self.action(depth, i, policy, batch, choices);
            self.actions[i * JOINTS..(i + 1) * JOINTS].copy_from_slice(&action);
            let input = &mut self.model.input[(from + i) * dynamics.inputs()..(from + i + 1) * dynamics.inputs()];
            if j == 0 {
                let demo_row = batch.rows[self.segments[i].start];
                input[..seen].copy_from_slice(&row(batch.model_inputs, dynamics.inputs(), demo_row)[..seen]);
            }
            dynamics.write_action(&action, &mut input[seen..]);
        }
        dynamics.net.forward(&mut self.model, from..from + count);
        self.store_predictions(depth, policy, dynamics, batch);
    }

    /// Predictions of this depth from the dynamics network's output, and the states of the next depth.
    fn store_predictions(&mut self, depth: Depth, policy: &Policy, dynamics: &Dynamics, batch: Batch) {
        let Depth { j, from, later, count, next_count } = depth;
        let (corpus, dim) = (batch.corpus, batch.corpus.task.state_dim());
        let sees_hand = if policy.features().needs_hand() { policy.features() } else { dynamics.features() };
        let after = later + if j > 0 { count } else { 0 };
        for i in 0..count {
            let start = self.segments[i].start;
            let action = row(&self.actions, JOINTS, i);
            let state = if j == 0 { corpus.state(batch.rows[start]) } else { row(&self.states, dim, later + i) };
            let prediction = &mut self.predictions[(from + i) * BASE_DIM..(from + i + 1) * BASE_DIM];
            dynamics.write_next(state, action, row(&self.model.output, BASE_DIM, from + i), prediction);
            if i < next_count {
                let next = &mut self.states[(after + i) * dim..(after + i + 1) * dim];
                next[..BASE_DIM].copy_from_slice(prediction);
                next[BASE_DIM..].copy_from_slice(&corpus.state(batch.rows[start])[BASE_DIM..]);
                self.hands[after + i] = sees_hand.hand(next);
            }
        }
    }

    /// a_t of segment `i` at this depth \[rad/s\].
    fn action(&self, depth: Depth, i: usize, policy: &Policy, batch: Batch, choices: &Choices) -> [f32; JOINTS] {
        let transition = self.segments[i].start + depth.j;
        let mean = match depth.j {
            0 => row(batch.mean, JOINTS, transition),
            _ => row(&self.policy.output, JOINTS, depth.later + i),
        };
        std::array::from_fn(|k| {
            let shift = match choices.action {
                ActionChoice::Sample => policy.log_std[k].exp() * batch.noise[transition * JOINTS + k],
                ActionChoice::Mean => 0.0,
            };
            policy.action_scaling().undo(k, mean[k] + shift)
        })
    }

    /// One step back. On entry the first `next_count` rows of `d_states` hold the gradient with respect to the next states as inputs of
    /// the next step, the others are 0; on return all rows hold it for this depth's states.
    fn retrace(&mut self, depth: Depth, policy: &Policy, dynamics: &Dynamics, batch: Batch, choices: &Choices) {
        let Depth { j, from, later, count, .. } = depth;
        let scale = choices.scale(batch.rows.len(), batch.demos);
        let residual = &dynamics.residual_scaling().std;
        for i in 0..count {
            let target = row(&batch.corpus.next, BASE_DIM, batch.rows[self.segments[i].start + j]);
            let prediction = row(&self.predictions, BASE_DIM, from + i);
            let d_state = &mut self.d_states[i * BASE_DIM..(i + 1) * BASE_DIM];
            let d_output = &mut self.model.d_output[(from + i) * BASE_DIM..(from + i + 1) * BASE_DIM];
            let mut loss = 0.0f32;
            for k in 0..BASE_DIM {
                let error = prediction[k] - target[k];
                loss += choices.weights[k] * error * error;
                d_state[k] += 2.0 * scale * choices.weights[k] * error;
                d_output[k] = d_state[k] * residual[k];
            }
            self.loss += f64::from(scale * loss);
        }
        dynamics.net.backward(&mut self.model, from..from + count);
        dynamics.net.backward_input(&mut self.model, from..from + count);
        for i in 0..count {
            let d_mean = self.d_mean(depth, i, policy, dynamics, batch, choices);
            let (array, at) = if j == 0 { (&mut self.d_first, i) } else { (&mut self.policy.d_output, later + i) };
            array[at * JOINTS..(at + 1) * JOINTS].copy_from_slice(&d_mean);
        }
        if j == 0 {
            return;
        }
        policy.net.backward(&mut self.policy, later..later + count);
        policy.net.backward_input(&mut self.policy, later..later + count);
        let (dim, width, model_width) = (batch.corpus.task.state_dim(), policy.net.inputs(), dynamics.inputs());
        for i in 0..count {
            let d_state = &mut self.d_states[i * BASE_DIM..(i + 1) * BASE_DIM];
            if dynamics.structure() == Structure::Kinematic {
                d_state[JOINTS..2 * JOINTS].fill(0.0); // dq' = a + network does not see dq
            }
            let (state, hand) = (row(&self.states, dim, later + i), &self.hands[later + i]);
            let (input, d_input) = (row(&self.policy.input, width, later + i), row(&self.policy.d_input, width, later + i));
            policy.features().backward(state, hand, input, d_input, d_state);
            let input = row(&self.model.input, model_width, from + i);
            let d_input = row(&self.model.d_input, model_width, from + i);
            dynamics.features().backward(state, hand, input, d_input, d_state);
        }
    }

    /// Gradient with respect to a mean action; adds the log standard deviations' where the action was sampled.
    fn d_mean(
        &mut self,
        depth: Depth,
        i: usize,
        policy: &Policy,
        dynamics: &Dynamics,
        batch: Batch,
        choices: &Choices,
    ) -> [f32; JOINTS] {
        let seen = dynamics.features().width();
        let d_given = &row(&self.model.d_input, dynamics.inputs(), depth.from + i)[seen..];
        let d_state = row(&self.d_states, BASE_DIM, i);
        let (given, unit) = (&dynamics.action_scaling().std, &policy.action_scaling().std);
        let kinematic = dynamics.structure() == Structure::Kinematic;
        let at = (self.segments[i].start + depth.j) * JOINTS;
        std::array::from_fn(|k| {
            let known = if kinematic { DT_S * d_state[k] + d_state[JOINTS + k] } else { 0.0 };
            let d_mean = (d_given[k] / given[k] + known) * unit[k];
            if choices.action == ActionChoice::Sample {
                self.d_log_std[k] += d_mean * policy.log_std[k].exp() * batch.noise[at + k];
            }
            d_mean
        })
    }

    /// Adds the gradient with respect to the first mean actions to `d_first` (rows of the batch x 9).
    pub fn scatter_first(&self, d_first: &mut [f32]) {
        for (segment, d) in self.segments.iter().zip(self.d_first.chunks_exact(JOINTS)) {
            d_first[segment.start * JOINTS..(segment.start + 1) * JOINTS].copy_from_slice(d);
        }
    }
}
