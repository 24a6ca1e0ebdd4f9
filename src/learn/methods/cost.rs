//! What an update costs, for the benchmark.

use super::hil::Hil;

impl Hil {
    /// Floating point operations of the matrix products of one update of behavior cloning alone on `rows` transitions.
    pub fn bc_flops_per_update(&self, rows: u64) -> u64 {
        let net = &self.parts().0.net;
        // forward, weights' gradient, and inputs' gradient, which the first layer does not need
        rows * (3 * net.flops_per_row() - net.first_layer_flops_per_row())
    }

    /// Floating point operations of the matrix products of an update of Algorithm 1 on `rows` transitions with as many segments as the
    /// last one drew: they decide how many first steps the pass over the demos' states has already done.
    pub fn flops_per_update(&self, rows: u64) -> u64 {
        let (policy, dynamics, segments) = self.parts();
        let later = 3 * policy.net.flops_per_row() * (rows - segments.len() as u64);
        let model = dynamics.map_or(0, |dynamics| {
            let net = &dynamics.net;
            // rollout: forward and inputs' gradient; fine-tuning: as behavior cloning
            rows * (5 * net.flops_per_row() - net.first_layer_flops_per_row())
        });
        self.bc_flops_per_update(rows) + later + model
    }
}
