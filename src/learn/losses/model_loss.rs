//! Eq. 6: L_model, the loss of the dynamics network on observed transitions.

use super::regression::{Loss, Regression};
use crate::config::ModelLoss;
use crate::learn::models::{Corpus, Dynamics, ModelSamples};

/// L_model and its gradient for one network.
pub struct ModelLearner {
    /// Weight of each entry of a state.
    weights: Vec<f32>,
    work: Regression,
}

impl ModelLearner {
    /// For networks with the settings and scalings of `dynamics`.
    pub fn new(dynamics: &Dynamics) -> Self {
        let weights = match dynamics.settings().loss {
            ModelLoss::RawSum => dynamics.residual_scaling().std.iter().map(|s| s * s).collect(),
            _ => vec![1.0; dynamics.layout().changing()],
        };
        ModelLearner { weights, work: Regression::default() }
    }

    /// L_model on the transitions `rows`, and its gradient.
    pub fn learn(&mut self, dynamics: &Dynamics, corpus: &Corpus, rows: &[usize]) -> (f64, &mut [f32]) {
        (self.loss(dynamics, corpus, rows, true), &mut self.work.gradient)
    }

    /// L_model on all of the transitions.
    pub fn validate(&mut self, dynamics: &Dynamics, corpus: &Corpus) -> f64 {
        let rows: Vec<usize> = (0..corpus.rows()).collect();
        self.loss(dynamics, corpus, &rows, false)
    }

    fn loss(&mut self, dynamics: &Dynamics, corpus: &Corpus, rows: &[usize], learn: bool) -> f64 {
        let kind = dynamics.settings().loss;
        let scale = match kind {
            ModelLoss::RawSum => corpus.mean_length() as f32 / rows.len() as f32,
            _ => 1.0 / (rows.len() * self.weights.len()) as f32,
        };
        let loss = Loss { weights: &self.weights, scale, huber: kind == ModelLoss::StandardisedHuber };
        self.work.loss(&dynamics.net, &ModelSamples { corpus, dynamics }, rows, &loss, learn)
    }
}
