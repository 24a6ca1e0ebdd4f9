//! State cloning from update to update: what Algorithm 3 draws before it begins.

use super::choices::Choices;
use super::pushes::Pushes;
use super::segments::{Segment, draw_segments};
use super::setting::Batch;
use super::{Workspace, state_cloning};
use crate::config::{ActionChoice, Pairs, TrainSettings};
use crate::learn::losses::acted::Acted;
use crate::learn::losses::behavior_cloning::draw_noise;
use crate::learn::losses::policy_loss::PolicyLoss;
use crate::learn::models::{Corpus, Dynamics, Policy};
use rand::Rng;

/// Algorithm 3 with its coins, its noise and its pushes.
pub struct StateCloning {
    /// rho: the probability that a step of a rollout begins in the demo's own state.
    rho: f64,
    pairs: Pairs,
    choices: Choices,
    segments: Vec<Segment>,
    noise: Vec<f32>,
    pushes: Pushes,
    work: Workspace,
}

impl StateCloning {
    /// As the settings say, with room for batches of at most `most_rows` states.
    pub fn new(settings: &TrainSettings, corpus: &Corpus, most_rows: usize) -> Self {
        let dim = corpus.layout.action_dim();
        StateCloning {
            rho: settings.rho,
            pairs: settings.sc.pairs,
            choices: Choices::new(settings, corpus),
            segments: Vec::with_capacity(most_rows),
            noise: Vec::with_capacity(most_rows * dim),
            pushes: Pushes::new(&settings.sc, &corpus.layout, most_rows),
            work: Workspace::new(dim, most_rows),
        }
    }

    /// `State_Cloning(pi_theta, f_phi, d, rho)` of the paper: L_SC over `demos`, numbers of demos of the corpus, in whose transitions `rows` the policy
    /// has `acted`.
    pub fn run<'a>(
        &'a mut self,
        (policy, dynamics): (&Policy, &Dynamics),
        acted: &Acted,
        (corpus, demos, rows): (&Corpus, &[usize], &[usize]),
        rng: &mut impl Rng,
    ) -> &'a PolicyLoss {
        let lengths = demos.iter().map(|demo| corpus.demo(*demo).len());
        draw_segments(lengths.clone(), self.rho, self.pairs, rng, &mut self.segments);
        let sampled = self.choices.action == ActionChoice::Sample;
        draw_noise(sampled, rows.len() * corpus.layout.action_dim(), rng, &mut self.noise);
        self.pushes.draw(lengths, rng);
        let StateCloning { choices, segments, noise, pushes, work, .. } = self;
        let batch = Batch { corpus, rows, demos: demos.len(), segments, noise, pushes: pushes.rows() };
        state_cloning(policy, dynamics, acted, batch, choices, work)
    }

    /// The segments that were drawn last.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }
}
