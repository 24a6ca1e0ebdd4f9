//! Settings of L_SC. Defaults are the preset `best`.

use super::choices::{FeatureSet, FingerCloning, Pairs, StateScale};
use super::scene::PulseSettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[train.sc]`: L_SC and the rollouts of Algorithm 3, in `hil` and in `sc`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScSettings {
    /// What the policy of method `sc` sees; those of the others see `train.features`. Without the near field it reaches the goal of
    /// pick-and-place and does not let go.
    pub features: FeatureSet,
    /// Scale of each state entry in L_SC; without effect under `train.loss = "raw-sum"`.
    pub scale: StateScale,
    /// Whether L_SC leaves out joint velocities. They repeat the action: with them, coming back to the path costs as much as leaving it.
    pub mask_dq: bool,
    /// Which commands of the fingers L_SC teaches; L_BC teaches all. Where L_BC has no weight (alpha = 1, `sc`), `"following"` means
    /// `"straight-through"`.
    pub fingers: FingerCloning,
    /// Error, in units of `scale`, beyond which L_SC grows as a line instead of a parabola; 0 = never. Without it the few large errors
    /// after a push outweigh the millimetres that decide a release.
    pub knee: f64,
    /// Whether L_SC is scaled so that its gradient is as long as that of L_BC before alpha mixes the two.
    pub balance: bool,
    /// Variance of the Gaussian noise on each action of a rollout in the dynamics network \[(rad/s)^2\].
    pub noise_variance: f64,
    /// Disturbance pulses in those rollouts, as `[simulate.pulses]` makes them in the simulator.
    pub pulses: PulseSettings,
    /// Which pairs enter the buffer B of Algorithm 3.
    pub pairs: Pairs,
}

impl Default for ScSettings {
    fn default() -> Self {
        ScSettings {
            features: FeatureSet::FkNear,
            scale: StateScale::Step,
            mask_dq: true,
            fingers: FingerCloning::Following,
            knee: 0.3,
            balance: true,
            noise_variance: 0.001,
            pulses: PulseSettings { probability: 0.03, ..PulseSettings::default() },
            pairs: Pairs::BeforeRecovery,
        }
    }
}
