//! L_BC beside another objective.

use crate::config::{ActionChoice, Objective, TrainSettings};
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::learn::losses::behavior_cloning::{Batch, Choices, Workspace};
use crate::learn::losses::{Acted, behavior_cloning, shards};
use crate::learn::methods::batches::Batches;
use crate::learn::models::{Corpus, Policy, PolicySamples};
use rand::Rng;

/// What the gradient of L_BC needs.
pub struct Demos {
    choices: Choices,
    /// State-action pairs per update; 0 = one whole demo.
    batch: usize,
    acted: Acted,
    work: Workspace,
    gradient: Vec<f32>,
}

impl Demos {
    /// In batches as `[train]` has them. L_BC is that of the mean action, in units of the demo actions, whatever `train.loss` and
    /// `train.action` say: lambda means the same in all presets.
    pub fn new(settings: &TrainSettings, layout: &Layout) -> Self {
        let of_mean = TrainSettings { loss: Objective::StandardisedMean, action: ActionChoice::Mean, ..settings.clone() };
        Demos {
            choices: Choices::new(&of_mean),
            batch: settings.bc_batch,
            acted: Acted::default(),
            work: Workspace::new(layout.action_dim(), settings.bc_batch),
            gradient: Vec::new(),
        }
    }

    /// Adds lambda grad L_BC of the policy's network, over pairs of the demos that `rng` draws, to a gradient; L_BC.
    ///
    /// # Errors
    /// [`Error::Failed`] when L_BC is no number any more.
    pub fn add_gradient(
        &mut self,
        policy: &Policy,
        corpus: &Corpus,
        lambda: f64,
        rng: &mut impl Rng,
        to: &mut [f32],
    ) -> Result<f64> {
        let (samples, rows) = (PolicySamples { corpus, policy }, Batches::new(corpus, self.batch).draw(rng));
        self.acted.forward(samples, &rows, None);
        let batch = Batch { samples, rows: &rows, demos: rows.len() as f64 / corpus.mean_length() };
        let (l_bc, _) = behavior_cloning(&self.acted, batch, &self.choices, rng, &mut self.work);
        if !l_bc.value.is_finite() {
            let (name, value) = (l_bc.name, l_bc.value);
            return Err(Error::Failed(format!("{name} is {value}: lower train.bc_rl.learning_rate or train.bc_rl.lambda")));
        }
        self.gradient.resize(to.len(), 0.0);
        self.acted.gradient(policy, lambda * l_bc, &mut self.gradient);
        shards::add_scaled(to, &self.gradient, 1.0);
        Ok(l_bc.value)
    }
}
