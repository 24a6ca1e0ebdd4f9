//! The loss of the dynamics network over several steps (`pretrain.steps`): it runs on its own predictions under the actions that a demo
//! executed, every prediction is compared with the demo's state (Eq. 6), and the gradient comes back through time.

use super::corpus::Corpus;
use super::dynamics::Dynamics;
use super::hand::Hand;
use super::regression::{Loss, bend, knee};
use super::shards;
use crate::nn::{LANES, Lanes, Panels, Pass, panels_of};
use crate::state::{BASE_DIM, JOINTS};
use rayon::prelude::*;

/// The workspace, and the gradient of the last batch.
#[derive(Default)]
pub struct MultiStep {
    shards: Vec<Shard>,
    /// Gradient with respect to the parameters.
    pub gradient: Vec<f32>,
}

/// Rollouts of one shard, those of most steps first: at depth j the first `counts[j]` of them are still under way. The panels of all
/// depths lie one after another.
#[derive(Default)]
struct Shard {
    /// First transition of each rollout, and its number of steps.
    rollouts: Vec<(usize, usize)>,
    counts: Vec<usize>,
    pass: Pass,
    states: Panels,
    hands: Vec<Hand>,
    predictions: Panels,
    /// Actions or targets of one depth.
    rows: Panels,
    /// Gradient with respect to the states of one depth.
    d_states: Panels,
    loss: f64,
}

/// Steps of the rollouts that begin at each of these transitions: `steps`, or fewer where the demo ends before.
pub fn horizons<'a>(corpus: &'a Corpus, rows: &'a [usize], steps: usize) -> impl Iterator<Item = (usize, usize)> + 'a {
    rows.iter().map(move |r| {
        let end = corpus.starts[corpus.starts.partition_point(|start| start <= r)];
        (*r, steps.min(end - r))
    })
}

impl MultiStep {
    /// Loss of rollouts of `steps` steps from each of `rows`, with its gradient in `self`. `loss` is Eq. 6 for all their predictions.
    pub fn loss(&mut self, dynamics: &Dynamics, corpus: &Corpus, rows: &[usize], steps: usize, loss: &Loss) -> f64 {
        let active = shards::count(rows.len());
        self.shards.resize_with(active.max(self.shards.len()), Shard::default);
        self.shards[..active].par_iter_mut().enumerate().for_each(|(i, shard)| {
            shard.deal(horizons(corpus, &rows[shards::range(rows.len(), active, i)], steps));
            shard.run(dynamics, corpus, loss);
        });
        self.gradient.resize(dynamics.net.params().len(), 0.0);
        dynamics.net.finish_gradient(self.shards[..active].iter_mut().map(|shard| &mut shard.pass), &mut self.gradient);
        self.shards[..active].iter().map(|shard| shard.loss).sum()
    }
}

impl Shard {
    fn deal(&mut self, rollouts: impl Iterator<Item = (usize, usize)>) {
        self.rollouts.clear();
        self.rollouts.extend(rollouts);
        self.rollouts.sort_by_key(|(_, steps)| std::cmp::Reverse(*steps));
        let longest = self.rollouts.first().map_or(0, |(_, steps)| *steps);
        self.counts.clear();
        self.counts.extend((0..longest).map(|j| self.rollouts.partition_point(|(_, steps)| *steps > j)));
    }

    /// First panel of depth `j`, and the number of its panels.
    fn depth(&self, j: usize) -> (usize, usize) {
        (self.counts[..j].iter().map(|c| panels_of(*c)).sum(), panels_of(self.counts[j]))
    }

    fn run(&mut self, dynamics: &Dynamics, corpus: &Corpus, loss: &Loss) {
        let panels = self.counts.iter().map(|c| panels_of(*c)).sum();
        let first = panels_of(self.rollouts.len());
        self.pass.reserve(&dynamics.net, panels);
        self.states.reserve(corpus.task.state_dim(), panels);
        self.predictions.reserve(BASE_DIM, panels);
        self.d_states.reserve(BASE_DIM, first);
        self.d_states.span_mut(&(0..first)).fill(Lanes::default());
        self.hands.resize(panels, Hand::default());
        self.loss = 0.0;
        self.states.write_rows(0, self.rollouts.len(), |i| corpus.state(self.rollouts[i].0));
        for j in 0..self.counts.len() {
            self.advance(j, dynamics, corpus);
        }
        for j in (0..self.counts.len()).rev() {
            self.retrace(j, dynamics, corpus, loss);
        }
        dynamics.net.begin_gradient(&mut self.pass);
        dynamics.net.add_gradient(&mut self.pass, 0..panels);
    }

    /// One step of all rollouts that reach depth `j`.
    fn advance(&mut self, j: usize, dynamics: &Dynamics, corpus: &Corpus) {
        let ((from, panels), seen) = (self.depth(j), dynamics.features().width());
        let (dim, rollouts) = (corpus.task.state_dim(), &self.rollouts);
        self.rows.reserve(JOINTS, panels);
        self.rows.write_rows(0, self.counts[j], |i| corpus.executed(rollouts[i].0 + j));
        for at in from..from + panels {
            let (state, input) = (self.states.panel(at), self.pass.input.panel_mut(at));
            self.hands[at] = dynamics.features().hand(state);
            dynamics.features().forward(state, &self.hands[at], &mut input[..seen]);
            dynamics.write_action(self.rows.panel(at - from), &mut input[seen..]);
        }
        dynamics.net.forward(&mut self.pass, from..from + panels);
        for at in from..from + panels {
            let (state, output) = (self.states.panel(at), self.pass.output.panel(at));
            dynamics.write_next(state, self.rows.panel(at - from), output, self.predictions.panel_mut(at));
        }
        let next_count = self.counts.get(j + 1).copied().unwrap_or(0);
        for at in from..from + panels_of(next_count) {
            let (before, after) = self.states.split_at_mut(at + panels);
            after[..BASE_DIM].copy_from_slice(self.predictions.panel(at));
            after[BASE_DIM..dim].copy_from_slice(&before[at * dim..(at + 1) * dim][BASE_DIM..]);
        }
    }

    /// One step back. On entry the rows of `d_states` that go on to the next depth hold the gradient with respect to its states, the
    /// others 0; on return all rows hold it for this depth's states.
    fn retrace(&mut self, j: usize, dynamics: &Dynamics, corpus: &Corpus, loss: &Loss) {
        let ((from, panels), rollouts) = (self.depth(j), &self.rollouts);
        let (std, knee) = (&dynamics.residual_scaling().std, knee(loss.huber));
        self.rows.reserve(BASE_DIM, panels);
        self.rows.write_rows(0, self.counts[j], |i| corpus.next(rollouts[i].0 + j));
        for at in from..from + panels {
            let (targets, d_state) = (self.rows.panel(at - from), self.d_states.panel_mut(at - from));
            let (d_output, filled) = (self.pass.d_output.panel_mut(at), self.counts[j] - (at - from) * LANES);
            let mut sum = Lanes::default();
            for (k, prediction) in self.predictions.panel(at).iter().enumerate() {
                let mut error = (*prediction - targets[k]) / std[k];
                error.0[filled.min(LANES)..].fill(0.0); // no rollout
                let bent = bend(error, knee);
                sum += bent * (error * 2.0 - bent) * loss.weights[k];
                d_state[k] += bent * (2.0 * loss.scale * loss.weights[k]) / std[k];
                d_output[k] = d_state[k] * std[k];
            }
            self.loss += sum.0.iter().map(|sum| f64::from(loss.scale * sum)).sum::<f64>();
        }
        dynamics.net.backward(&mut self.pass, from..from + panels);
        if j == 0 {
            return;
        }
        dynamics.net.backward_input(&mut self.pass, from..from + panels);
        for at in from..from + panels {
            let (state, d_state) = (self.states.panel(at), self.d_states.panel_mut(at - from));
            dynamics.known_backward(d_state);
            let (input, d_input) = (self.pass.input.panel(at), self.pass.d_input.panel(at));
            dynamics.features().backward(state, &self.hands[at], input, d_input, d_state);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{FeatureSet, PretrainSettings, Structure};
    use crate::demo::Demo;
    use crate::learn::pretrain_dynamics::{loss_weights, model_loss};
    use crate::learn::regression::Regression;
    use crate::learn::testing::{demo, demos, random_states};
    use crate::seed::stream;
    use crate::tasks::Task;

    /// A network, and demos that jump about: what it puts out moves the states that it sees next.
    fn model(structure: Structure) -> (Dynamics, Corpus) {
        let jumping = |i: u64| {
            let like = demo(Task::Stack, 40, i);
            let states = random_states(Task::Stack, 41, i);
            Demo::new(Task::Stack, states, like.actions().to_vec(), like.executed().to_vec()).expect("lengths match")
        };
        let corpus = Corpus::new((0..3).map(jumping).collect::<Vec<_>>(), "training").expect("demos");
        let settings = PretrainSettings { structure, features: FeatureSet::Fk, hidden_units: 6, ..Default::default() };
        (Dynamics::new(&corpus, &settings, &mut stream(2, "test", 0)), corpus)
    }

    fn rolled(work: &mut MultiStep, dynamics: &Dynamics, corpus: &Corpus, rows: &[usize], steps: usize) -> f64 {
        let weights = loss_weights(dynamics);
        let pairs = horizons(corpus, rows, steps).map(|(_, steps)| steps).sum();
        work.loss(dynamics, corpus, rows, steps, &model_loss(dynamics, &weights, pairs, 40.0))
    }

    #[test]
    fn one_step_is_equation_6() {
        let (dynamics, corpus) = model(Structure::Kinematic);
        let rows: Vec<usize> = (0..corpus.rows()).rev().collect();
        let (mut many, mut one, weights) = (MultiStep::default(), Regression::default(), loss_weights(&dynamics));
        let l_many = rolled(&mut many, &dynamics, &corpus, &rows, 1);
        let loss = model_loss(&dynamics, &weights, rows.len(), 40.0);
        let l_one = one.loss(&dynamics.net, &corpus.model_samples(&dynamics), &rows, &loss, true);
        assert!((l_many / l_one - 1.0).abs() < 1e-4, "{l_many} against {l_one}");
        for (a, b) in many.gradient.iter().zip(&one.gradient) {
            assert!((a - b).abs() < 1e-4 * (1.0 + b.abs()), "{a} against {b}");
        }
    }

    #[test]
    fn gradients_through_time_equal_finite_differences() {
        for structure in [Structure::Kinematic, Structure::Plain] {
            let (mut dynamics, corpus) = model(structure);
            // among them rollouts that the end of a demo cuts short
            let rows: Vec<usize> = [0, 7, 20, 37, 38, 39, 60, 79, 80, corpus.rows() - 1].to_vec();
            let mut work = MultiStep::default();
            rolled(&mut work, &dynamics, &corpus, &rows, 4);
            let gradient = work.gradient.clone();
            let largest = gradient.iter().fold(0.0f32, |most, d| most.max(d.abs()));
            for i in (0..gradient.len()).step_by(7) {
                let h = 1e-2;
                let mut at = |by: f32| {
                    dynamics.net.params_mut()[i] += by;
                    let loss = rolled(&mut work, &dynamics, &corpus, &rows, 4);
                    dynamics.net.params_mut()[i] -= by;
                    loss
                };
                let (numeric, analytic) = ((at(h) - at(-h)) / f64::from(2.0 * h), f64::from(gradient[i]));
                let error = (numeric - analytic).abs();
                assert!(error < 0.01 * f64::from(largest) + 0.02 * analytic.abs(), "{structure:?} {i}: {analytic}, {numeric}");
            }
        }
    }

    #[test]
    fn rollouts_end_with_their_demo() {
        let corpus = Corpus::new(demos(Task::PickUp, 2, 10, 0), "training").expect("demos");
        let steps: Vec<_> = horizons(&corpus, &[0, 8, 9, 10, 20], 5).collect();
        assert_eq!(steps, [(0, 5), (8, 2), (9, 1), (10, 5), (20, 1)]);
    }
}
