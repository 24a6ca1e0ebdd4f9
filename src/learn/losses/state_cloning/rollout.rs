//! Segments of Algorithm 3 advancing together, and the gradient back through time: policy, features and dynamics network.
//!
//! Segments are sorted by length, longest first, so that at depth j the first `counts[j]` of them are still under way. The panels of all
//! depths lie one after another, each depth beginning a new one; depth 0 has none in the policy's pass, because [`super::Acted`] has
//! done that pass. Lanes without a segment hold zeros, and no gradient enters them.

use super::segments::Segment;
use super::setting::Setting;
use crate::config::ActionChoice;
use crate::learn::losses::regression::bend;
use crate::learn::models::{Dynamics, Hand, Policy, row};
use crate::math::exp_f32;
use crate::nn::{LANES, Lanes, Panels, Pass, kernel, panels_of};
use std::ops::Range;

/// Steps of a group of segments: what it keeps for the way back, some 4 kB a step, then waits in a core's second cache.
const GROUP_STEPS: usize = 240;
/// Segments that a group is made of, as many at a time: they fill the largest tile of a product.
const GROUP_SEGMENTS: usize = 32;

/// The workspace of one shard.
#[derive(Default)]
pub struct Rollout {
    segments: Vec<Segment>,
    /// Segments under way at each depth.
    counts: Vec<usize>,
    /// The policy's passes; holds the gradient of its parameters, first actions left out.
    pub policy: Pass,
    model: Pass,
    /// States at all depths.
    states: Panels,
    /// One a panel of `states`; those of depth 0 are not used.
    hands: Vec<Hand>,
    /// Actions at the current depth \[rad/s\].
    actions: Panels,
    /// Standard normal numbers at the current depth, where actions are sampled.
    noise: Panels,
    /// Disturbances at the current depth \[rad/s\].
    pushes: Panels,
    /// Which fingers' commands are taught at the current depth.
    taught: Panels,
    /// Predictions at all depths.
    predictions: Panels,
    /// Gradient with respect to the states at the current depth.
    d_states: Panels,
    /// Gradient with respect to each segment's first mean action.
    d_first: Panels,
    /// The same of all groups so far, row by row, and the transitions that they belong to.
    d_first_rows: Vec<f32>,
    first_rows: Vec<usize>,
    /// What should have been predicted in the panel at hand.
    targets: Vec<Lanes>,
    /// Gradient with respect to the log standard deviations.
    pub d_log_std: Vec<f32>,
    /// This shard's part of L_SC.
    pub loss: f64,
}

/// Where one depth lies.
#[derive(Clone, Copy)]
struct Depth {
    j: usize,
    /// First panel of states, predictions and the dynamics network's pass.
    from: usize,
    /// First panel in the policy's pass, for j > 0.
    later: usize,
    panels: usize,
    count: usize,
    next_count: usize,
}

impl Depth {
    /// Panel `p` of this depth: its place in the dynamics network's pass and, for j > 0, in the policy's.
    fn places(self) -> impl Iterator<Item = (usize, usize, usize)> {
        (0..self.panels).map(move |p| (p, self.from + p, self.later + p))
    }

    /// Segments of panel `p`.
    fn segments(self, p: usize) -> Range<usize> {
        p * LANES..self.count.min((p + 1) * LANES)
    }
}

/// Segments, longest first, in groups that advance together.
fn groups(segments: &[Segment]) -> impl Iterator<Item = &[Segment]> {
    let mut rest = segments;
    std::iter::from_fn(move || {
        let (mut size, mut steps) = (0, 0);
        while size < rest.len() && steps < GROUP_STEPS {
            let more = &rest[size..rest.len().min(size + GROUP_SEGMENTS)];
            (size, steps) = (size + more.len(), steps + more.iter().map(|s| s.steps).sum::<usize>());
        }
        let (group, after) = rest.split_at(size);
        rest = after;
        (size > 0).then_some(group)
    })
}

impl Rollout {
    /// Allocates for any segments of `rows` transitions, none of more than `longest` steps.
    pub fn reserve(&mut self, policy: &Policy, dynamics: &Dynamics, rows: usize, longest: usize) {
        let layout = dynamics.layout();
        let (dim, changing) = (layout.action_dim(), layout.changing());
        self.first_rows.clear();
        self.first_rows.reserve(rows);
        self.d_first_rows.clear();
        self.d_first_rows.reserve(rows * dim);
        self.targets.resize(changing, Lanes::default());
        self.d_log_std.resize(dim, 0.0);
        let rows = rows.min(GROUP_STEPS + GROUP_SEGMENTS * longest);
        let (first, panels) = (panels_of(rows), panels_of(rows) + longest); // each depth may leave one panel half empty
        self.policy.reserve(&policy.net, panels);
        self.model.reserve(&dynamics.net, panels);
        self.states.reserve(layout.state_dim(), panels);
        self.predictions.reserve(changing, panels);
        self.d_states.reserve(changing, first);
        self.taught.reserve(layout.fingers().len(), first);
        [&mut self.actions, &mut self.noise, &mut self.pushes, &mut self.d_first]
            .into_iter()
            .for_each(|array| array.reserve(dim, first));
        self.hands.reserve(panels.saturating_sub(self.hands.len()));
        self.segments.clear();
        self.segments.reserve(rows);
        self.counts.clear();
        self.counts.reserve(longest);
    }

    /// Takes in a group.
    fn deal(&mut self, segments: &[Segment]) {
        self.segments.clear();
        self.segments.extend_from_slice(segments);
        self.counts.clear();
        self.counts.resize(self.segments.first().map_or(0, |s| s.steps), 0);
        for segment in &self.segments {
            self.counts[..segment.steps].iter_mut().for_each(|c| *c += 1);
        }
    }

    fn depth(&self, j: usize) -> Depth {
        let from = self.counts[..j].iter().map(|c| panels_of(*c)).sum();
        let later = if j > 0 { from - panels_of(self.counts[0]) } else { 0 };
        let next_count = self.counts.get(j + 1).copied().unwrap_or(0);
        Depth { j, from, later, panels: panels_of(self.counts[j]), count: self.counts[j], next_count }
    }

    /// Loss and gradient of segments, sorted by length, longest first.
    pub fn run(&mut self, segments: &[Segment], setting: Setting) {
        let Setting { policy, .. } = setting;
        self.loss = 0.0;
        self.d_log_std.fill(0.0);
        self.first_rows.clear();
        self.d_first_rows.clear();
        policy.net.begin_gradient(&mut self.policy);
        for group in groups(segments) {
            self.deal(group);
            self.run_group(setting);
        }
    }

    fn run_group(&mut self, setting: Setting) {
        let Setting { policy, .. } = setting;
        self.prepare(setting);
        for j in 0..self.counts.len() {
            self.advance(self.depth(j), setting);
        }
        for j in (0..self.counts.len()).rev() {
            self.retrace(self.depth(j), setting);
        }
        policy.net.add_gradient(&mut self.policy, 0..self.hands.len() - panels_of(self.segments.len()));
        for (i, segment) in self.segments.iter().enumerate() {
            let (at, dim) = (self.d_first_rows.len(), self.d_first.width());
            self.first_rows.push(segment.start);
            self.d_first_rows.resize(at + dim, 0.0);
            self.d_first.read_row(i, &mut self.d_first_rows[at..]);
        }
    }

    /// The gradient with respect to the first mean action of each segment, and the transition that it belongs to.
    pub fn first_actions(&self) -> impl Iterator<Item = (usize, &[f32])> {
        self.first_rows.iter().copied().zip(self.d_first_rows.chunks_exact(self.d_first.width().max(1)))
    }

    fn prepare(&mut self, setting: Setting) {
        let Setting { policy, dynamics, batch, .. } = setting;
        let panels: usize = self.counts.iter().map(|c| panels_of(*c)).sum();
        let (layout, first) = (dynamics.layout(), panels_of(self.segments.len()));
        self.policy.grow(&policy.net, panels - first);
        self.model.grow(&dynamics.net, panels);
        self.states.grow(layout.state_dim(), panels);
        self.hands.resize(panels, Hand::default());
        self.predictions.grow(layout.changing(), panels);
        for array in [&mut self.actions, &mut self.noise, &mut self.pushes, &mut self.d_first] {
            array.grow(layout.action_dim(), first);
        }
        self.d_states.grow(layout.changing(), first);
        self.taught.grow(layout.fingers().len(), first);
        self.d_states.span_mut(&(0..first)).fill(Lanes::default());
        let demo_row = |i: usize| batch.rows[self.segments[i].start];
        self.states.write_rows(0, self.segments.len(), |i| batch.corpus.state(demo_row(i)));
        dynamics.features().write_transitions(batch.corpus, self.segments.len(), demo_row, &mut self.model.input);
    }

    /// One step forward: a_t from the policy, s_{t+1} from the dynamics network.
    fn advance(&mut self, depth: Depth, setting: Setting) {
        let Setting { policy, dynamics, .. } = setting;
        let seen = dynamics.features().width();
        if depth.j > 0 {
            let sees_hand = if policy.features().needs_hand() { policy.features() } else { dynamics.features() };
            for (_, at, later) in depth.places() {
                let state = self.states.panel(at);
                self.hands[at] = sees_hand.hand(state);
                policy.features().forward(state, &self.hands[at], self.policy.input.panel_mut(later));
                dynamics.features().forward(state, &self.hands[at], &mut self.model.input.panel_mut(at)[..seen]);
            }
            policy.net.forward(&mut self.policy, depth.later..depth.later + depth.panels);
        }
        self.act(depth, setting);
        for (p, at, _) in depth.places() {
            dynamics.write_action(self.actions.panel(p), &mut self.model.input.panel_mut(at)[seen..]);
        }
        dynamics.net.forward(&mut self.model, depth.from..depth.from + depth.panels);
        for (p, at, _) in depth.places() {
            let (state, output) = (self.states.panel(at), self.model.output.panel(at));
            dynamics.write_next(state, self.actions.panel(p), output, self.predictions.panel_mut(at));
        }
        for p in 0..panels_of(depth.next_count) {
            let (from, to) = (depth.from + p, depth.from + depth.panels + p);
            let (dim, changing) = (self.states.width(), self.predictions.width());
            let (before, after) = self.states.split_at_mut(to);
            let next = &mut after[..dim];
            next[..changing].copy_from_slice(self.predictions.panel(from));
            next[changing..].copy_from_slice(&before[from * dim..(from + 1) * dim][changing..]);
        }
        self.states.clear_tail((depth.from + depth.panels) * LANES + depth.next_count);
    }

    /// The actions of this depth \[rad/s\].
    fn act<'a>(&mut self, depth: Depth, setting: Setting<'a>) {
        let Setting { policy, mean, batch, choices, .. } = setting;
        let (sampled, pushed) = (choices.action == ActionChoice::Sample, !batch.pushes.is_empty());
        let (segments, dim) = (&self.segments, self.actions.width());
        let of_step = |rows: &'a [f32]| move |i: usize| row(rows, dim, segments[i].start + depth.j);
        if depth.j == 0 {
            self.actions.write_rows(0, depth.count, of_step(mean));
        }
        if sampled {
            self.noise.write_rows(0, depth.count, of_step(batch.noise));
        }
        if pushed {
            self.pushes.write_rows(0, depth.count, of_step(batch.pushes));
        }
        for (p, _, later) in depth.places() {
            if depth.j > 0 {
                self.actions.panel_mut(p).copy_from_slice(self.policy.output.panel(later));
            }
            let (actions, noise, pushes) = (self.actions.panel_mut(p), self.noise.panel(p), self.pushes.panel(p));
            for (k, (action, eps)) in actions.iter_mut().zip(noise).enumerate() {
                let shift = if sampled { *eps * exp_f32(policy.log_std[k]) } else { Lanes::default() };
                *action = (*action + shift).map(|mean| policy.action_scaling().undo(k, mean));
                if pushed {
                    *action += pushes[k];
                }
            }
        }
        self.actions.clear_tail(depth.count);
    }

    /// One step back. On entry the first `next_count` rows of `d_states` hold the gradient with respect to the next states as inputs of
    /// the next step, the others are 0; on return all rows hold it for this depth's states.
    fn retrace(&mut self, depth: Depth, setting: Setting) {
        let Setting { policy, dynamics, .. } = setting;
        for (p, at, _) in depth.places() {
            self.add_loss(depth, p, at, setting);
        }
        dynamics.net.backward_through(&mut self.model, depth.from..depth.from + depth.panels);
        self.retrace_actions(depth, setting);
        if depth.j == 0 {
            return;
        }
        let all = depth.later..depth.later + depth.panels;
        policy.net.backward(&mut self.policy, all.clone());
        policy.net.backward_input(&mut self.policy, all);
        for (p, at, later) in depth.places() {
            let d_state = self.d_states.panel_mut(p);
            dynamics.known_backward(d_state);
            let (state, hand) = (self.states.panel(at), &self.hands[at]);
            let (input, d_input) = (self.policy.input.panel(later), self.policy.d_input.panel(later));
            policy.features().backward(state, hand, input, d_input, d_state);
            let (input, d_input) = (self.model.input.panel(at), self.model.d_input.panel(at));
            dynamics.features().backward(state, hand, input, d_input, d_state);
        }
    }

    /// Adds the loss of panel `p` of this depth and its gradient with respect to the predictions, and hands that to the dynamics network.
    fn add_loss(&mut self, depth: Depth, p: usize, at: usize, setting: Setting) {
        let Setting { dynamics, batch, choices, .. } = setting;
        let scale = choices.scale(batch.rows.len(), batch.demos);
        let (segments, targets) = (depth.segments(p), &mut self.targets);
        let target = |i: usize| batch.corpus.next(batch.rows[self.segments[i].start + depth.j]);
        kernel::interleave(targets, std::array::from_fn(|lane| target((segments.start + lane).min(segments.end - 1))));
        if segments.len() < LANES {
            let predictions = self.predictions.panel(at); // no error where there is no segment
            targets.iter_mut().zip(predictions).for_each(|(target, prediction)| target.take_from(segments.len(), *prediction));
        }
        let (d_state, d_output) = (self.d_states.panel_mut(p), self.model.d_output.panel_mut(at));
        let mut loss = Lanes::default();
        for (k, prediction) in self.predictions.panel(at).iter().enumerate() {
            let (error, weight) = (*prediction - targets[k], choices.weights[k]);
            let bent = bend(error, choices.knees[k]);
            loss += bent * (error * 2.0 - bent) * weight;
            d_state[k] += bent * (2.0 * scale * weight);
            d_output[k] = d_state[k] * dynamics.residual_scaling().std[k];
        }
        self.loss += loss.0.iter().map(|loss| f64::from(scale * loss)).sum::<f64>();
    }

    /// Gradient with respect to the mean actions; adds the log standard deviations' where actions were sampled.
    fn retrace_actions(&mut self, depth: Depth, setting: Setting) {
        let Setting { policy, dynamics, batch, choices, .. } = setting;
        let seen = dynamics.features().width();
        let (positions, velocities) = (dynamics.layout().positions(), dynamics.layout().velocities());
        let (segments, dim, fingers) = (&self.segments, self.actions.width(), &choices.fingers);
        let taught = |i: usize| row(&choices.taught, fingers.len(), batch.rows[segments[i].start + depth.j]);
        self.taught.write_rows(0, depth.count, taught);
        if choices.action == ActionChoice::Sample {
            self.noise.write_rows(0, depth.count, |i| row(batch.noise, dim, segments[i].start + depth.j));
        }
        for (p, at, later) in depth.places() {
            let (d_given, d_state) = (&self.model.d_input.panel(at)[seen..], self.d_states.panel(p));
            let d_mean = if depth.j == 0 { self.d_first.panel_mut(p) } else { self.policy.d_output.panel_mut(later) };
            for k in 0..dim {
                let straight_through = choices.straight_through && fingers.contains(&k);
                // Of a joint that integrates its command.
                let along = |joints: &Range<usize>| if k < joints.len() { d_state[joints.start + k] } else { Lanes::default() };
                let known = along(&positions) * dynamics.dt_s() + along(&velocities);
                let learned = d_given[k] / dynamics.action_scaling().std[k];
                let d_action = match (straight_through, dynamics.is_kinematic()) {
                    (true, _) => known,
                    (false, true) => learned + known,
                    (false, false) => learned,
                };
                d_mean[k] = d_action * policy.action_scaling().std[k];
                if fingers.contains(&k) {
                    d_mean[k] = d_mean[k] * self.taught.panel(p)[k - fingers.start];
                }
                if choices.action == ActionChoice::Sample {
                    self.d_log_std[k] += (d_mean[k] * self.noise.panel(p)[k]).sum() * exp_f32(policy.log_std[k]);
                }
            }
        }
    }
}
