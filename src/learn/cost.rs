//! What an update costs, for the benchmark.

use super::learner::Learner;

impl Learner {
    /// Floating point operations of the matrix products of one update of behavior cloning alone on `rows` transitions.
    pub fn bc_flops_per_update(&self, rows: u64) -> u64 {
        let net = &self.policy.net;
        // forward, weights' gradient, and inputs' gradient, which the first layer does not need
        rows * (3 * net.flops_per_row() - net.first_layer_flops_per_row())
    }

    /// Floating point operations of the matrix products of one update of Algorithm 1 on `rows` transitions in `segments` segments.
    pub fn flops_per_update(&self, rows: u64, segments: u64) -> u64 {
        let later = 3 * self.policy.net.flops_per_row() * (rows - segments);
        let model = self.model.as_ref().map_or(0, |model| {
            let net = &model.dynamics.net;
            // rollout: forward and inputs' gradient; fine-tuning: as behavior cloning
            rows * (5 * net.flops_per_row() - net.first_layer_flops_per_row())
        });
        self.bc_flops_per_update(rows) + later + model
    }
}
