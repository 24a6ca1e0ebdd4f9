//! Algorithm 3: state cloning. The policy acts in the dynamics network from a demo's first state; L_SC (Eq. 5) compares the states.
//!
//! Recovery puts the learner back on a *known* demo state. So all coins are drawn first; each rollout then falls apart into segments
//! that begin at demo states, and the segments of all demos advance together as rows of one matrix. Sequential depth is the longest
//! segment. The first action of a segment is the policy's action in a demo state, which behavior cloning has already computed.

use super::corpus::Corpus;
use super::dynamics::{DT_S, Dynamics, STEP_FLOOR};
use super::policy::Policy;
use super::rollout::Rollout;
use super::scaling::Scaling;
use super::shards;
use crate::config::{ActionChoice, FingerCloning, Objective, Pairs, StateScale, TrainSettings};
use crate::state::{ARM_JOINTS, BASE_DIM, FINGERS, JOINTS};
use rand::{Rng, RngExt};
use rayon::prelude::*;

/// Spread of a state entry below which L_SC counts it as constant under `sc_scale = "state"`.
const STATE_FLOOR: f32 = 0.01;

/// Steps in the dynamics network between two demo states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// First transition, counted within the batch.
    pub start: usize,
    /// Number of predictions that enter the buffer B.
    pub steps: usize,
}

/// Draws the coins of Algorithm 3 for demos of these lengths and cuts them into segments, in order.
pub fn draw_segments(
    lengths: impl Iterator<Item = usize>,
    rho: f64,
    pairs: Pairs,
    rng: &mut impl Rng,
    segments: &mut Vec<Segment>,
) {
    segments.clear();
    let mut first = 0;
    for length in lengths {
        let (mut start, end) = (first, first + length);
        for t in first..end {
            let recovered = rng.random::<f64>() < rho;
            if recovered || t + 1 == end {
                // a pair stored after recovery is (s^E, s^E): it has neither loss nor gradient
                let steps = t + 1 - start - usize::from(recovered && pairs == Pairs::AfterRecovery);
                if steps > 0 {
                    segments.push(Segment { start, steps });
                }
                start = t + 1;
            }
        }
        first = end;
    }
}

/// Share of the commanded motion that a finger may miss and still count as one that follows. Of 77,000 commands above the fingers' dead
/// zone in recorded stacks 28 % were followed to a twentieth, 70 % not at all (hand open, or holding), and 2 % lie between.
const FOLLOWING: f32 = 0.5;

/// Which fingers' commands L_SC teaches in transition `r`: 1, or 0.
fn taught_fingers(fingers: FingerCloning, corpus: &Corpus, r: usize) -> [f32; FINGERS] {
    std::array::from_fn(|finger| {
        let i = ARM_JOINTS + finger;
        let commanded = DT_S * corpus.executed(r)[i];
        let missed = corpus.next(r)[i] - corpus.state(r)[i] - commanded;
        f32::from(match fingers {
            FingerCloning::All => true,
            FingerCloning::Following => missed.abs() <= FOLLOWING * commanded.abs(),
            FingerCloning::None => false,
        })
    })
}

/// What does not change from update to update.
pub struct Choices {
    /// Weight of each state entry's squared error.
    pub weights: [f32; BASE_DIM],
    /// 1 where the gradient reaches a finger's command, else 0: transitions x 3.
    pub taught: Vec<f32>,
    /// Error of each state entry beyond which the loss is a line.
    pub knees: [f32; BASE_DIM],
    /// Whether L_SC is a sum over a demo instead of a mean.
    objective: Objective,
    /// Which pairs enter B.
    pub pairs: Pairs,
    /// rho.
    pub rho: f64,
    /// Whether actions are sampled.
    pub action: ActionChoice,
}

impl Choices {
    /// From the settings and the training demos.
    pub fn new(settings: &TrainSettings, corpus: &Corpus) -> Self {
        let dim = corpus.task.state_dim();
        let std = match (settings.loss, settings.sc_scale) {
            (Objective::RawSum, _) => vec![1.0; BASE_DIM],
            (_, StateScale::State) => {
                Scaling::fit(corpus.rows(), dim, STATE_FLOOR, |r, row| row.copy_from_slice(corpus.state(r))).std
            }
            (_, StateScale::Step) => {
                let change = |r: usize, row: &mut [f32]| {
                    let entries = row.iter_mut().zip(corpus.next(r).iter().zip(corpus.state(r)));
                    entries.for_each(|(change, (next, state))| *change = next - state);
                };
                Scaling::fit(corpus.rows(), BASE_DIM, STEP_FLOOR, change).std
            }
        };
        let velocity = |i: usize| (JOINTS..2 * JOINTS).contains(&i);
        let finger = |i: usize| i < 2 * JOINTS && i % JOINTS >= ARM_JOINTS;
        let masked = |i: usize| settings.sc_mask_dq && velocity(i) || settings.sc_fingers == FingerCloning::None && finger(i);
        let weights: [f32; BASE_DIM] = std::array::from_fn(|i| if masked(i) { 0.0 } else { 1.0 / (std[i] * std[i]) });
        let knee = if settings.sc_knee > 0.0 { settings.sc_knee as f32 } else { f32::INFINITY };
        Choices {
            weights,
            knees: weights.map(|weight| if weight > 0.0 { knee / weight.sqrt() } else { f32::INFINITY }),
            taught: (0..corpus.rows()).flat_map(|r| taught_fingers(settings.sc_fingers, corpus, r)).collect(),
            objective: settings.loss,
            pairs: settings.sc_pairs,
            rho: settings.rho,
            action: settings.action,
        }
    }

    /// Factor of every squared error: L_SC is a mean over entries and transitions, or a sum over each of the demos.
    pub fn scale(&self, rows: usize, demos: usize) -> f32 {
        match self.objective {
            Objective::RawSum => 1.0 / demos as f32,
            Objective::StandardisedMean => 1.0 / (rows * BASE_DIM) as f32,
        }
    }
}

/// The demos of one update.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// The training demos.
    pub corpus: &'a Corpus,
    /// Transitions of the corpus, demo by demo.
    pub rows: &'a [usize],
    /// Number of demos.
    pub demos: usize,
    /// The policy's mean actions in those states, standardised, rows x 9.
    pub mean: &'a [f32],
    /// Standard normal numbers, rows x 9; empty when the mean is taken.
    pub noise: &'a [f32],
    /// Disturbances of the rollouts' actions \[rad/s\], rows x 9; empty when there are none.
    pub pushes: &'a [f32],
}

/// The workspace: one rollout a shard.
#[derive(Default)]
pub struct Workspace {
    rollouts: Vec<Rollout>,
    sorted: Vec<Segment>,
    active: usize,
    /// Gradient of L_SC with respect to the mean actions in the demos' states, rows x 9.
    pub d_first: Vec<f32>,
    /// Gradient of L_SC with respect to the policy's parameters through all later steps.
    pub gradient: Vec<f32>,
    /// Gradient of L_SC with respect to the log standard deviations.
    pub d_log_std: [f32; JOINTS],
}

/// Algorithm 3 over a batch: L_SC, with its gradient in `work`. The dynamics network is only passed through, never learned here.
pub fn state_cloning(
    policy: &Policy,
    dynamics: &Dynamics,
    batch: Batch,
    segments: &[Segment],
    choices: &Choices,
    work: &mut Workspace,
) -> f64 {
    let (longest, most_rows) = (batch.corpus.longest(), batch.demos * batch.corpus.longest());
    work.sorted.clear();
    work.sorted.reserve(most_rows);
    work.d_first.clear();
    work.d_first.reserve(most_rows * JOINTS);
    work.sorted.extend_from_slice(segments);
    work.sorted.sort_unstable_by_key(|s| (std::cmp::Reverse(s.steps), s.start));
    work.active = shards::count(batch.rows.len()).min(shards::MAX_SEGMENT_SHARDS);
    work.rollouts.resize_with(shards::MAX_SEGMENT_SHARDS, Rollout::default);
    work.rollouts.iter_mut().for_each(|rollout| rollout.provide(policy, dynamics, most_rows, longest));
    let (active, sorted) = (work.active, &work.sorted);
    work.rollouts[..active].par_iter_mut().enumerate().for_each(|(i, rollout)| {
        rollout.run(share(sorted, active, i), policy, dynamics, batch, choices);
    });
    work.collect(policy, batch.rows.len())
}

/// Shard `i` of `count`: as much work as the others have. Long segments stay together, so that few panels are half empty.
fn share(sorted: &[Segment], count: usize, i: usize) -> &[Segment] {
    let work = |s: &Segment| 2 * s.steps - 1; // the first step needs only the dynamics network
    let total: usize = sorted.iter().map(work).sum();
    let cut = |i: usize| {
        let mut before = 0;
        let place = sorted.iter().position(|s| {
            before += work(s);
            before - work(s) >= total * i / count
        });
        if i < count { place.unwrap_or(sorted.len()) } else { sorted.len() }
    };
    &sorted[cut(i)..cut(i + 1)]
}

impl Workspace {
    fn collect(&mut self, policy: &Policy, rows: usize) -> f64 {
        self.gradient.resize(policy.net.params().len(), 0.0);
        policy
            .net
            .finish_gradient(self.rollouts[..self.active].iter_mut().map(|rollout| &mut rollout.policy), &mut self.gradient);
        self.d_first.clear();
        self.d_first.resize(rows * JOINTS, 0.0);
        self.d_log_std = [0.0; JOINTS];
        let mut l_sc = 0.0;
        for rollout in &self.rollouts[..self.active] {
            l_sc += rollout.loss;
            shards::add_scaled(&mut self.d_log_std, &rollout.d_log_std, 1.0);
            rollout.scatter_first(&mut self.d_first);
        }
        l_sc
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;
    use crate::seed::stream;
    use crate::tasks::Task;

    fn segments(rho: f64, pairs: Pairs) -> Vec<Segment> {
        let mut out = Vec::new();
        draw_segments([50, 3].into_iter(), rho, pairs, &mut stream(0, "coins", 0), &mut out);
        out
    }

    #[test]
    fn shares_cover_the_segments_and_are_alike() {
        let sorted: Vec<Segment> = (0..90).map(|i| Segment { start: i, steps: 1 + (90 - i) / 9 }).collect();
        for count in 1..4 {
            let shares: Vec<&[Segment]> = (0..count).map(|i| share(&sorted, count, i)).collect();
            assert_eq!(shares.concat(), sorted);
            let work = |i: usize| shares[i].iter().map(|s| 2 * s.steps - 1).sum::<usize>();
            assert!((1..count).all(|i| work(i).abs_diff(work(0)) < 40));
        }
        assert!(share(&[], 2, 0).is_empty() && share(&[], 2, 1).is_empty());
    }

    #[test]
    fn l_sc_teaches_fingers_that_follow_their_commands() {
        let (task, finger, command) = (Task::PickUp, ARM_JOINTS + 1, 0.4);
        let moves = [0.9, 0.6, 0.3, 0.0, -1.0, 1.6]; // shares of the commanded motion
        let mut states = vec![vec![0.0; task.state_dim()]];
        for share in moves {
            let mut next = states[states.len() - 1].clone();
            next[finger] += share * DT_S * command;
            states.push(next);
        }
        let actions = [[0.0; ARM_JOINTS + 1].as_slice(), &[command, 0.0]].concat().repeat(moves.len());
        let demo = Demo::new(task, states.concat(), actions.clone(), actions).expect("lengths match");
        let corpus = Corpus::new(&[demo], "training").expect("a demo");
        let taught = |sc_fingers| Choices::new(&TrainSettings { sc_fingers, ..Default::default() }, &corpus).taught;
        let of_finger: Vec<f32> = taught(FingerCloning::Following).into_iter().skip(1).step_by(FINGERS).collect();
        assert_eq!(of_finger, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(taught(FingerCloning::All), [1.0; 6 * FINGERS]);
        assert_eq!(taught(FingerCloning::None), [0.0; 6 * FINGERS]);
    }

    #[test]
    fn segments_cover_the_demos() {
        assert_eq!(segments(0.0, Pairs::AfterRecovery), [Segment { start: 0, steps: 50 }, Segment { start: 50, steps: 3 }]);
        assert_eq!(segments(1.0, Pairs::BeforeRecovery).len(), 53);
        assert!(segments(1.0, Pairs::AfterRecovery).is_empty());
        let before = segments(0.4, Pairs::BeforeRecovery);
        assert_eq!(before.iter().map(|s| s.steps).sum::<usize>(), 53);
        assert!(before.iter().all(|s| s.start >= 50 || s.start + s.steps <= 50), "a segment crosses two demos");
    }
}
