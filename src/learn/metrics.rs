//! What is known after each epoch of learning, and the table of all epochs.

use super::corpus::row;
use super::exact;
use crate::state::{ARM_JOINTS, JOINTS};
use crate::table::{Table, Values};
use serde::{Deserialize, Deserializer, Serialize, de};

/// Labelled finger velocity above which the hand closes or holds, and below whose negative it opens \[rad/s\].
const FINGER_COMMAND_RAD_S: f32 = 0.2;

/// The stages of learning: Algorithm 4, the warm start, Algorithm 1.
pub const STAGES: [&str; 3] = ["pretrain", WARM_START, HIL];
/// Behavior cloning alone, before Algorithm 1.
pub const WARM_START: &str = "warm-start";
/// Algorithm 1.
pub const HIL: &str = "hil";

/// A name out of [`STAGES`].
pub type StageName = &'static str;

fn known_stage<'de, D: Deserializer<'de>>(text: D) -> Result<StageName, D::Error> {
    let name = String::deserialize(text)?;
    let known = STAGES.into_iter().find(|stage| *stage == name);
    known.ok_or_else(|| de::Error::custom(format!("unknown stage \"{name}\"; known: {}", STAGES.join(", "))))
}

/// Root mean square error of the mean action on the validation demos \[rad/s\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ActionError {
    /// The six arm joints.
    #[serde(with = "exact")]
    pub arm: f64,
    /// The three fingers.
    #[serde(with = "exact")]
    pub fingers: f64,
}

/// One epoch. What was not computed is NaN.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpochMetrics {
    /// One of `STAGES`.
    #[serde(deserialize_with = "known_stage")]
    pub stage: StageName,
    /// Epoch of the stage, from 1.
    pub epoch: u64,
    /// Epochs of the stage.
    pub epochs: u64,
    /// Updates of the stage so far.
    pub updates: u64,
    /// Learning rate of the last update.
    #[serde(with = "exact")]
    pub learning_rate: f64,
    /// L_BC, mean of the epoch.
    #[serde(with = "exact")]
    pub l_bc: f64,
    /// L_SC, mean of the epoch.
    #[serde(with = "exact")]
    pub l_sc: f64,
    /// L_mix, mean of the epoch.
    #[serde(with = "exact")]
    pub l_mix: f64,
    /// d_conv, mean of the epoch.
    #[serde(with = "exact")]
    pub d_conv: f64,
    /// alpha, mean of the epoch.
    #[serde(with = "exact")]
    pub alpha: f64,
    /// Loss of the dynamics network (Eq. 6) on training transitions, mean of the epoch.
    #[serde(with = "exact")]
    pub l_model: f64,
    /// L_BC of the averaged weights on the validation demos.
    #[serde(with = "exact")]
    pub validation_l_bc: f64,
    /// Loss of the dynamics network on the validation demos.
    #[serde(with = "exact")]
    pub validation_l_model: f64,
    /// Norm of the gradient of L_BC alone at the epoch's first update.
    #[serde(with = "exact")]
    pub grad_bc: f64,
    /// Norm of the gradient of L_SC alone at the epoch's first update.
    #[serde(with = "exact")]
    pub grad_sc: f64,
    /// Updates left out so far because a gradient was not finite.
    pub skipped: u64,
    /// Validation error while the demo opens its fingers, keeps them still, closes or holds.
    pub errors: [ActionError; 3],
}

impl EpochMetrics {
    /// Where training stands after the epoch: "hil epoch 3 of 60".
    pub fn place(&self) -> String {
        format!("{} epoch {} of {}", self.stage, self.epoch, self.epochs)
    }

    /// Nothing known yet.
    pub(super) fn new(stage: &'static str, epoch: u64, epochs: u64) -> Self {
        let nan = f64::NAN;
        EpochMetrics {
            stage,
            epoch,
            epochs,
            updates: 0,
            learning_rate: nan,
            l_bc: nan,
            l_sc: nan,
            l_mix: nan,
            d_conv: nan,
            alpha: nan,
            l_model: nan,
            validation_l_bc: nan,
            validation_l_model: nan,
            grad_bc: nan,
            grad_sc: nan,
            skipped: 0,
            errors: [ActionError { arm: nan, fingers: nan }; 3],
        }
    }
}

/// Errors of mean actions (standardised, rows x 9) against entry i of the label of row r, by what the labelled fingers do.
pub(super) fn action_errors(label: impl Fn(usize, usize) -> f32, mean: &[f32], unit: &[f32], offset: &[f32]) -> [ActionError; 3] {
    let mut sums = [[0.0f64; 3]; 3]; // arm, fingers, rows
    for r in 0..mean.len() / JOINTS {
        let (label, mean): ([f32; JOINTS], _) = (std::array::from_fn(|i| label(r, i)), row(mean, JOINTS, r));
        let fingers = (ARM_JOINTS..JOINTS).map(|i| offset[i] + unit[i] * label[i]).sum::<f32>() / (JOINTS - ARM_JOINTS) as f32;
        let class = 1 + usize::from(fingers > FINGER_COMMAND_RAD_S) - usize::from(fingers < -FINGER_COMMAND_RAD_S);
        let square = |i: usize| f64::from(unit[i] * (mean[i] - label[i])).powi(2);
        sums[class][0] += (0..ARM_JOINTS).map(square).sum::<f64>();
        sums[class][1] += (ARM_JOINTS..JOINTS).map(square).sum::<f64>();
        sums[class][2] += 1.0;
    }
    sums.map(|[arm, fingers, rows]| ActionError {
        arm: (arm / (rows * ARM_JOINTS as f64)).sqrt(),
        fingers: (fingers / (rows * (JOINTS - ARM_JOINTS) as f64)).sqrt(),
    })
}

type NumberColumn = (&'static str, &'static str, fn(&EpochMetrics) -> f64);

const NUMBERS: [NumberColumn; 18] = [
    ("learning_rate", "Learning rate of the epoch's last update", |m| m.learning_rate),
    ("l_bc", "L_BC (Eq. 3), mean over the epoch's updates", |m| m.l_bc),
    ("l_sc", "L_SC (Eq. 5), mean over the epoch's updates; NaN where not computed", |m| m.l_sc),
    ("l_mix", "L_mix (Eq. 1), mean over the epoch's updates", |m| m.l_mix),
    ("d_conv", "Degree of policy convergence (Eq. 4), mean over the epoch's updates", |m| m.d_conv),
    ("alpha", "Mixing weight, mean over the epoch's updates", |m| m.alpha),
    ("l_model", "Loss of the dynamics network (Eq. 6), mean over the epoch's updates", |m| m.l_model),
    ("validation_l_bc", "L_BC of the averaged weights on the validation demos", |m| m.validation_l_bc),
    ("validation_l_model", "Loss of the dynamics network on the validation demos", |m| m.validation_l_model),
    ("grad_bc", "Norm of the gradient of L_BC alone at the epoch's first update", |m| m.grad_bc),
    ("grad_sc", "Norm of the gradient of L_SC alone at the epoch's first update", |m| m.grad_sc),
    ("skipped_updates", "Updates left out so far because a gradient was not finite", |m| m.skipped as f64),
    ("arm_error_opening_rad_s", "Validation RMS error, arm joints, while the demo opens its fingers", |m| m.errors[0].arm),
    ("finger_error_opening_rad_s", "Validation RMS error, fingers, while the demo opens them", |m| m.errors[0].fingers),
    ("arm_error_still_rad_s", "Validation RMS error, arm joints, while the demo's fingers keep still", |m| m.errors[1].arm),
    ("finger_error_still_rad_s", "Validation RMS error, fingers, while the demo keeps them still", |m| m.errors[1].fingers),
    ("arm_error_closing_rad_s", "Validation RMS error, arm joints, while the demo closes or holds", |m| m.errors[2].arm),
    ("finger_error_closing_rad_s", "Validation RMS error, fingers, while the demo closes or holds", |m| m.errors[2].fingers),
];

/// One row an epoch.
pub(super) fn table(epochs: &[EpochMetrics]) -> Table {
    let integers = |pick: fn(&EpochMetrics) -> u64| Values::I64(epochs.iter().map(|m| pick(m) as i64).collect());
    let stages = Values::Text(epochs.iter().map(|m| m.stage.to_string()).collect());
    let mut table = Table::default()
        .with("stage", "pretrain, warm-start (behavior cloning alone) or hil (Algorithm 1)", stages)
        .with("epoch", "Epoch of the stage, from 1", integers(|m| m.epoch))
        .with("updates", "Updates of the stage so far", integers(|m| m.updates));
    for (name, doc, pick) in NUMBERS {
        table = table.with(name, doc, Values::F64(epochs.iter().map(pick).collect()));
    }
    table
}

/// Mean over the updates of an epoch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mean {
    sum: f64,
    count: u64,
}

impl Mean {
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    /// NaN when nothing was added.
    pub fn get(&self) -> f64 {
        self.sum / self.count as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_go_to_the_class_of_the_labelled_fingers() {
        let mut targets = vec![0.0; 2 * JOINTS];
        targets[ARM_JOINTS..JOINTS].fill(0.8);
        let mut mean = targets.clone();
        (0..ARM_JOINTS).for_each(|i| mean[i] += 0.1);
        let errors = action_errors(|r, i| targets[r * JOINTS + i], &mean, &[2.0; JOINTS], &[0.0; JOINTS]);
        assert!((errors[2].arm - 0.2).abs() < 1e-6 && errors[2].fingers == 0.0);
        assert!(errors[1].arm == 0.0 && errors[0].arm.is_nan());
    }
}
