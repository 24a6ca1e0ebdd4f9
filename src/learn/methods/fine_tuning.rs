//! The dynamics network during Algorithm 1: rollouts pass through it, and it keeps learning from observed transitions (Eq. 6).

use super::optimizer::{push_adam, read_adam};
use crate::learn::losses::ModelLearner;
use crate::learn::models::{Corpus, Dynamics, Reader, vector};
use crate::nn::{Adam, clip_by_global_norm};
use crate::tensor::NamedTensor;

/// What the names of the saved arrays begin with.
pub const NET: &str = "dynamics.net";

/// f_phi with what its fine-tuning needs.
pub struct FineTuning {
    /// f_phi.
    pub dynamics: Dynamics,
    adam: Adam,
    loss: ModelLearner,
}

impl FineTuning {
    /// Of a pretrained network.
    pub fn new(dynamics: Dynamics) -> Self {
        FineTuning { adam: Adam::new(dynamics.net.params().len()), loss: ModelLearner::new(&dynamics), dynamics }
    }

    /// One update on transitions `rows` of the training demos; returns L_model before it and the norm of its gradient. L_mix never
    /// reaches the network.
    pub fn update(&mut self, corpus: &Corpus, rows: &[usize], learning_rate: f64) -> (f64, f64) {
        let FineTuning { dynamics, adam, loss } = self;
        let (l_model, gradient) = loss.learn(dynamics, corpus, rows);
        let norm = clip_by_global_norm(gradient, dynamics.settings().clip_norm);
        adam.step(&mut dynamics.net.params_mut(), gradient, learning_rate);
        (l_model, norm)
    }

    /// L_model on the validation demos.
    pub fn validate(&mut self, held_out: &Corpus) -> f64 {
        self.loss.validate(&self.dynamics, held_out)
    }

    /// All that changes from update to update; returns the steps of the optimiser.
    pub fn save(&self, out: &mut Vec<NamedTensor>) -> u32 {
        out.push(vector(NET, self.dynamics.net.params()));
        push_adam(out, NET, &self.adam);
        self.adam.state().2
    }

    /// The inverse of [`FineTuning::save`].
    ///
    /// # Errors
    /// Says what is missing or does not fit.
    pub fn restore(&mut self, reader: &Reader, steps: u32) -> Result<(), String> {
        let len = self.dynamics.net.params().len();
        self.dynamics.net.params_mut().copy_from_slice(&reader.tensor(NET, &[len])?);
        self.adam = read_adam(reader, NET, len, steps)?;
        Ok(())
    }
}
