//! Behavior cloning alone: before Algorithm 1, and as the method `bc`.

use super::{BC_REMEDY, Hil, OFFSETS, Update, WARM_START, Work};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::learn::losses::behavior_cloning;
use crate::learn::losses::behavior_cloning::Batch;
use crate::learn::methods::batches::Batches;
use crate::learn::models::PolicySamples;
use crate::learn::run::{EpochMetrics, Mean, Stage};
use crate::nn::cosine;
use crate::seed::stream;

impl Hil {
    /// An epoch of the warm start: pairs shuffled across demos.
    pub(super) fn warm_start(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt) -> Result<EpochMetrics> {
        let total = self.settings.warm_start(self.inputs.train.rows());
        let (first, last) = (self.settings.warm_start_learning_rate, self.settings.final_learning_rate);
        let batches = Batches::new(&self.inputs.train, self.settings.bc_batch);
        let shuffled = batches.shuffled(&mut stream(self.seed, "train.warm-start", epoch));
        let (mut l_bc, mut d_conv, mut rate) = (Mean::default(), Mean::default(), f64::NAN);
        for rows in shuffled.iter().take(total.saturating_sub(self.descent.updates) as usize) {
            interrupt.check()?;
            rate = cosine(first, last, self.descent.updates, total);
            let cloned = self.clone_behavior(rows, rate)?;
            l_bc.add(cloned.l_bc);
            d_conv.add(cloned.d_conv);
        }
        let mut row = EpochMetrics::new(WARM_START, epoch + 1, stage.epochs);
        let values = [l_bc.get(), l_bc.get(), d_conv.get(), 0.0, rate];
        ["l_bc", "l_mix", "d_conv", "alpha", "learning_rate"].iter().zip(values).for_each(|(name, value)| row.set(name, value));
        Ok(row)
    }

    /// One update of behavior cloning alone (Algorithm 2) on the transitions `rows` of training demos.
    ///
    /// # Errors
    /// [`crate::error::Error::Failed`] when the loss is not a number.
    pub fn clone_behavior(&mut self, rows: &[usize], learning_rate: f64) -> Result<Update> {
        self.draws += 1;
        let finite = self.judge();
        let (corpus, descent, Work { acted, offsets, bc_choices, bc_work, .. }) =
            (&self.inputs.train, &mut self.descent, &mut self.work);
        let samples = PolicySamples { corpus, policy: &descent.policy };
        let offsets = offsets.draw(rows.len(), &mut stream(self.seed, OFFSETS, self.draws));
        acted.forward(samples, rows, Some(offsets));
        let batch = Batch { samples, rows, demos: rows.len() as f64 / corpus.mean_length() };
        let mut rng = stream(self.seed, "train.bc", self.draws);
        let (l_bc, d_conv) = behavior_cloning(acted, batch, bc_choices, &mut rng, bc_work);
        finite(l_bc.name, l_bc.value, BC_REMEDY)?;
        descent.update(acted, 1.0 * l_bc, learning_rate);
        Ok(Update { l_bc: l_bc.value, l_sc: f64::NAN, l_mix: l_bc.value, d_conv, alpha: 0.0, l_model: f64::NAN })
    }
}
