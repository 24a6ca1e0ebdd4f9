//! What the averaged weights are worth on the validation demos.

use super::fine_tuning::FineTuning;
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::learn::losses::behavior_cloning::{self as bc, Batch, Choices};
use crate::learn::models::{Corpus, Policy, PolicySamples};
use crate::learn::run::EpochMetrics;
use rand::Rng;

/// Labelled finger velocity above which the hand closes or holds, and below whose negative it opens \[rad/s, and what counts as one\].
const FINGER_COMMAND_RAD_S: f32 = 0.2;

/// Root mean square error of the mean action on the validation demos \[rad/s, and what counts as one\].
#[derive(Clone, Copy, Debug, PartialEq)]
struct ActionError {
    /// What drives the arm, or all, where nothing is known to drive fingers.
    arm: f64,
    /// What drives the fingers.
    fingers: f64,
}

/// Reports L_BC, the errors of the mean actions and, with a dynamics network, L_model.
///
/// # Errors
/// [`Error::Failed`] when a loss is none: an epoch may end just after its last update has gone wrong.
pub fn validate(
    policy: &Policy,
    held_out: &Corpus,
    choices: &Choices,
    model: Option<&mut FineTuning>,
    rng: &mut impl Rng,
    metrics: &mut EpochMetrics,
) -> Result<()> {
    let rows: Vec<usize> = (0..held_out.rows()).collect();
    let samples = PolicySamples { corpus: held_out, policy };
    let (l_bc, mean) = bc::validate(Batch { samples, rows: &rows, demos: held_out.demos() as f64 }, choices, rng);
    let scaling = policy.action_scaling();
    let label = |r: usize, i: usize| scaling.apply(i, held_out.commanded(r)[i]);
    let classes = ["opening", "still", "closing"].into_iter();
    for (class, error) in classes.zip(action_errors(&held_out.layout, label, &mean, (&scaling.std, &scaling.mean))) {
        metrics.set(&format!("arm_error_{class}_rad_s"), error.arm);
        metrics.set(&format!("finger_error_{class}_rad_s"), error.fingers);
    }
    metrics.set("validation_l_bc", l_bc);
    check("L_BC (Eq. 3)", l_bc, metrics, "lower train.learning_rate or train.warm_start_learning_rate, or set train.clip_norm")?;
    if let Some(model) = model {
        let l_model = model.validate(held_out);
        metrics.set("validation_l_model", l_model);
        check("the loss of the dynamics network (Eq. 6)", l_model, metrics, "lower train.dynamics_learning_rate")?;
    }
    Ok(())
}

fn check(term: &str, value: f64, row: &EpochMetrics, remedy: &str) -> Result<()> {
    if value.is_finite() {
        return Ok(());
    }
    let (place, updates) = (row.place(), row.updates);
    Err(Error::Failed(format!("{term} on the validation demos is {value} after {place} (update {updates}): {remedy}")))
}

/// Errors of mean actions (standardised, rows x A) against entry i of the label of row r, by what the labelled fingers do; `unit` and
/// `offset` undo the standardisation.
fn action_errors(
    layout: &Layout,
    label: impl Fn(usize, usize) -> f32,
    mean: &[f32],
    (unit, offset): (&[f32], &[f32]),
) -> [ActionError; 3] {
    let (dim, fingers) = (layout.action_dim(), layout.fingers());
    let others = || (0..dim).filter(|i| !fingers.contains(i));
    let mut sums = [[0.0f64; 3]; 3]; // arm, fingers, rows
    for (r, mean) in mean.chunks_exact(dim).enumerate() {
        let closing = fingers.clone().map(|i| (offset[i] + unit[i] * label(r, i)) / layout.closing_unit(i)).sum::<f32>()
            / fingers.len().max(1) as f32;
        let class = 1 + usize::from(closing > FINGER_COMMAND_RAD_S) - usize::from(closing < -FINGER_COMMAND_RAD_S);
        let one = |i: usize| layout.action_unit(i).unwrap_or(1.0);
        let square = |i: usize| f64::from(unit[i] * (mean[i] - label(r, i)) / one(i)).powi(2);
        sums[class][0] += others().map(square).sum::<f64>();
        sums[class][1] += fingers.clone().map(square).sum::<f64>();
        sums[class][2] += 1.0;
    }
    sums.map(|[arm, fingers_sum, rows]| ActionError {
        arm: (arm / (rows * others().count() as f64)).sqrt(),
        fingers: (fingers_sum / (rows * fingers.len() as f64)).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::tests::testing::Toy;

    #[test]
    fn errors_go_to_the_class_of_the_labelled_fingers() {
        let layout = Toy::Stack.layout();
        let dim = layout.action_dim();
        let mut targets = vec![0.0; 2 * dim];
        targets[layout.fingers()].fill(0.8);
        let mut mean = targets.clone();
        layout.arm().for_each(|i| mean[i] += 0.1);
        let errors = action_errors(&layout, |r, i| targets[r * dim + i], &mean, (&vec![2.0; dim], &vec![0.0; dim]));
        assert!((errors[2].arm - 0.2).abs() < 1e-6 && errors[2].fingers == 0.0);
        assert!(errors[1].arm == 0.0 && errors[0].arm.is_nan());
    }
}
