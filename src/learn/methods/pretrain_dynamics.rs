//! Algorithm 4: pretraining the dynamics network on the transitions that the demos observed.

use super::batches::Batches;
use super::patience::Patience;
use crate::config::PretrainSettings;
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::learn::limits::before_the_first_update;
use crate::learn::losses::ModelLearner;
use crate::learn::models::{Corpus, Dynamics, ModelReport, error_table};
use crate::learn::run::{EpochMetrics, Mean, Metric, table};
use crate::nn::{Adam, Ema, clip_by_global_norm, cosine};
use crate::seed::stream;
use std::borrow::Cow;

/// Learns f_phi from the executed actions of `train`; `log` is called after every epoch.
///
/// # Errors
/// [`Error::Usage`] for a setting out of range; [`Error::Failed`] without demos or when the loss is not a number;
/// [`Error::Interrupted`].
pub fn pretrain_dynamics<'a>(
    train: impl Into<Cow<'a, [Demo]>>,
    validation: impl Into<Cow<'a, [Demo]>>,
    settings: &PretrainSettings,
    seed: u64,
    log: &mut dyn FnMut(&EpochMetrics, &'static [Metric]),
    interrupt: &Interrupt,
) -> Result<(Dynamics, ModelReport)> {
    settings.validate()?;
    let (corpus, held_out) = (Corpus::new(train, "training")?, Corpus::new(validation, "validation")?);
    let mut dynamics = Dynamics::new(&corpus, settings, &mut stream(seed, "pretrain.init", 0));
    let (mut l_model, mut adam) = (ModelLearner::new(&dynamics), Adam::new(dynamics.net.params().len()));
    let mut ema = Ema::new(dynamics.net.params(), settings.ema_decay);
    let (mut averaged, mut updates, mut patience) = (dynamics.clone(), 0, Patience::new(settings));
    let batches = Batches::new(&corpus, settings.batch_rows);
    let (total, mut epochs) = (settings.epochs * batches.per_epoch(), Vec::new());
    for epoch in 0..settings.epochs {
        let (mut mean, mut rate) = (Mean::default(), f64::NAN);
        for rows in batches.shuffled(&mut stream(seed, "pretrain.order", epoch)).iter() {
            interrupt.check()?;
            let (value, gradient) = l_model.learn(&dynamics, &corpus, rows); // Eq. 6
            if !value.is_finite() {
                return Err(no_number(value, updates));
            }
            clip_by_global_norm(gradient, settings.clip_norm);
            rate = cosine(settings.learning_rate, settings.final_learning_rate, updates, total);
            adam.step(&mut dynamics.net.params_mut(), gradient, rate); // phi <- phi - grad L_model
            ema.update(dynamics.net.params());
            mean.add(value);
            updates += 1;
        }
        averaged.net.params_mut().copy_from_slice(ema.average());
        let validation = l_model.validate(&averaged, &held_out);
        let mut row = EpochMetrics::new("pretrain", epoch + 1, settings.epochs);
        row.updates = updates;
        let values = [rate, mean.get(), validation];
        METRICS.iter().zip(values).for_each(|(metric, value)| row.set(metric.name, value));
        check_validation(&row, validation)?;
        log(&row, &METRICS);
        epochs.push(row);
        if patience.ends_after(validation) {
            break;
        }
    }
    let errors = error_table(&averaged, &held_out, interrupt)?;
    Ok((averaged, ModelReport { errors, metrics: table(&epochs, &METRICS) }))
}

/// The numbers of an epoch.
static METRICS: [Metric; 3] = [
    Metric::column("learning_rate", "Learning rate of the epoch's last update"),
    Metric::shown("l_model", "l_model", "Loss of the dynamics network (Eq. 6), mean over the epoch's updates"),
    Metric::shown("validation_l_model", "validation l_model", "Loss of the dynamics network on the validation demos"),
];

const TERM: &str = "the loss of the dynamics network (Eq. 6)";
const REMEDY: &str = "lower pretrain.learning_rate or set pretrain.clip_norm; nothing was written";

/// The loss of an update after `updates` others is no number.
fn no_number(value: f64, updates: u64) -> Error {
    Error::Failed(match updates {
        0 => before_the_first_update(TERM, value, "pretrain.loss and pretrain.features"),
        _ => format!("{TERM} is {value} at update {}: {REMEDY}", updates + 1),
    })
}

/// An epoch may end just after its last update has gone wrong, and averaged weights go wrong by themselves; the validation demos show it.
fn check_validation(row: &EpochMetrics, value: f64) -> Result<()> {
    let (place, updates) = (row.place(), row.updates);
    if value.is_finite() {
        return Ok(());
    }
    Err(Error::Failed(format!("{TERM} on the validation demos is {value} after {place} (update {updates}): {REMEDY}")))
}
