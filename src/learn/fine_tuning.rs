//! The dynamics network during Algorithm 1: rollouts pass through it, and it keeps learning from observed transitions (Eq. 6).

use super::corpus::Corpus;
use super::dynamics::Dynamics;
use super::pretrain_dynamics::{loss_weights, model_loss, validation_loss};
use super::regression::Regression;
use crate::nn::{Adam, clip_by_global_norm};

/// f_phi with what rollouts through it and its fine-tuning need.
pub struct Model {
    /// f_phi.
    pub dynamics: Dynamics,
    weights: Vec<f32>,
    /// One a network of the ensemble, that of the network in use first.
    pub(super) adams: Vec<Adam>,
    work: Regression,
}

impl Model {
    /// A pretrained network.
    pub fn new(dynamics: Dynamics) -> Self {
        Model {
            weights: loss_weights(&dynamics),
            adams: (0..=dynamics.others.len()).map(|_| Adam::new(dynamics.net.params().len())).collect(),
            work: Regression::default(),
            dynamics,
        }
    }

    /// The next network of the ensemble is in use.
    pub fn turn(&mut self) {
        self.dynamics.turn();
        self.adams.rotate_left(1);
    }

    /// One update on transitions `rows` of the training demos; returns the loss before it and the norm of its gradient.
    pub fn fine_tune(&mut self, corpus: &Corpus, rows: &[usize], mean_length: f32, learning_rate: f64) -> (f64, f64) {
        let Model { dynamics, weights, adams, work } = self;
        let loss = model_loss(dynamics, weights, rows.len(), mean_length);
        let l_model = work.loss(&dynamics.net, &corpus.model_samples(dynamics), rows, &loss, true);
        let norm = clip_by_global_norm(&mut work.gradient, dynamics.settings().clip_norm);
        adams[0].step(&mut dynamics.net.params_mut(), &work.gradient, learning_rate);
        (l_model, norm)
    }

    /// Loss on the validation demos.
    pub fn validation_loss(&mut self, held_out: &Corpus) -> f64 {
        validation_loss(&self.dynamics, held_out, &mut self.work)
    }
}
