//! Algorithm 4: pretraining the dynamics network on the transitions that the demos observed.

use super::corpus::Corpus;
use super::dynamics::Dynamics;
use super::limits::{affordable, before_the_first_update};
use super::metrics::{EpochMetrics, Mean, table};
use super::model_report::{ModelReport, error_table};
use super::multi_step::{MultiStep, horizons};
use super::patience::Patience;
use super::regression::{Loss, Regression};
use crate::config::{ModelLoss, PretrainSettings};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::nn::{Adam, Ema, clip_by_global_norm, cosine};
use crate::seed::stream;
use crate::state::BASE_DIM;
use rand::seq::SliceRandom;
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
    log: &mut dyn FnMut(&EpochMetrics),
    interrupt: &Interrupt,
) -> Result<(Dynamics, ModelReport)> {
    settings.validate()?;
    let (corpus, held_out) = (Corpus::new(train, "training")?, Corpus::new(validation, "validation")?);
    if settings.steps > 1 {
        let rows = if settings.batch_rows == 0 { corpus.longest() } else { settings.batch_rows.min(corpus.rows()) };
        let keys = "pretrain.batch_rows, pretrain.steps or pretrain.hidden_units";
        affordable(rows * settings.steps, settings.hidden_layers, settings.hidden_units, keys)?;
    }
    let mut dynamics = Dynamics::new(&corpus, settings, &mut stream(seed, "pretrain.init", 0));
    let mut lesson = Lesson::new(&corpus, &dynamics);
    let batches = Batches::new(&corpus, settings.batch_rows);
    let total = settings.epochs * batches.per_epoch();
    let (mut work, mut epochs) = (Regression::default(), Vec::new());
    for member in 0..settings.ensemble as u64 {
        if member > 0 {
            dynamics.add_member(&mut stream(seed, "pretrain.init", member));
        }
        let mut adam = Adam::new(dynamics.net.params().len());
        let mut ema = Ema::new(dynamics.net.params(), settings.ema_decay);
        let (mut averaged, mut updates, mut patience) = (dynamics.clone(), 0, Patience::new(settings));
        for epoch in member * settings.epochs..(member + 1) * settings.epochs {
            let mut mean = Mean::default();
            let mut metrics = EpochMetrics::new("pretrain", epoch + 1, settings.epochs * settings.ensemble as u64);
            for rows in batches.shuffled(&mut stream(seed, "pretrain.order", epoch)).iter() {
                interrupt.check()?;
                let (l_model, gradient) = lesson.gradient(&dynamics, rows);
                if !l_model.is_finite() {
                    return Err(no_number(l_model, updates));
                }
                clip_by_global_norm(gradient, settings.clip_norm);
                metrics.learning_rate = cosine(settings.learning_rate, settings.final_learning_rate, updates, total);
                adam.step(&mut dynamics.net.params_mut(), gradient, metrics.learning_rate);
                ema.update(dynamics.net.params());
                mean.add(l_model);
                updates += 1;
            }
            averaged.net.params_mut().copy_from_slice(ema.average());
            (metrics.updates, metrics.l_model) = (updates, mean.get());
            metrics.validation_l_model = validation_loss(&averaged, &held_out, &mut work);
            check_validation(&metrics)?;
            log(&metrics);
            let flat = patience.ends_after(metrics.validation_l_model);
            epochs.push(metrics);
            if flat {
                break;
            }
        }
        dynamics = averaged;
    }
    dynamics.turn(); // the first network is in use
    let errors = error_table(&dynamics, &held_out, interrupt)?;
    Ok((dynamics, ModelReport { errors, metrics: table(&epochs) }))
}

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
fn check_validation(row: &EpochMetrics) -> Result<()> {
    let (value, place, updates) = (row.validation_l_model, row.place(), row.updates);
    if value.is_finite() {
        return Ok(());
    }
    Err(Error::Failed(format!("{TERM} on the validation demos is {value} after {place} (update {updates}): {REMEDY}")))
}

/// What there is to learn from, and how: Eq. 6, or the same over several steps.
struct Lesson<'a> {
    corpus: &'a Corpus,
    weights: Vec<f32>,
    mean_length: f32,
    one_step: Regression,
    many_steps: MultiStep,
}

impl<'a> Lesson<'a> {
    fn new(corpus: &'a Corpus, dynamics: &Dynamics) -> Self {
        Lesson {
            corpus,
            weights: loss_weights(dynamics),
            mean_length: corpus.rows() as f32 / corpus.demos() as f32,
            one_step: Regression::default(),
            many_steps: MultiStep::default(),
        }
    }

    /// Loss on the transitions `rows`, and its gradient.
    fn gradient(&mut self, dynamics: &Dynamics, rows: &[usize]) -> (f64, &mut [f32]) {
        let steps = dynamics.settings().steps;
        if steps == 1 {
            let loss = model_loss(dynamics, &self.weights, rows.len(), self.mean_length);
            let samples = self.corpus.model_samples(dynamics);
            return (self.one_step.loss(&dynamics.net, &samples, rows, &loss, true), &mut self.one_step.gradient);
        }
        let pairs = horizons(self.corpus, rows, steps).map(|(_, steps)| steps).sum();
        let loss = model_loss(dynamics, &self.weights, pairs, self.mean_length);
        (self.many_steps.loss(dynamics, self.corpus, rows, steps, &loss), &mut self.many_steps.gradient)
    }
}

/// Loss on all of the validation transitions.
pub(super) fn validation_loss(dynamics: &Dynamics, corpus: &Corpus, work: &mut Regression) -> f64 {
    let rows: Vec<usize> = (0..corpus.rows()).collect();
    let weights = loss_weights(dynamics);
    let loss = model_loss(dynamics, &weights, rows.len(), corpus.rows() as f32 / corpus.demos() as f32);
    work.loss(&dynamics.net, &corpus.model_samples(dynamics), &rows, &loss, false)
}

/// The weight of each entry in Eq. 6.
pub(super) fn loss_weights(dynamics: &Dynamics) -> Vec<f32> {
    match dynamics.settings().loss {
        ModelLoss::RawSum => dynamics.residual_scaling().std.iter().map(|s| s * s).collect(),
        _ => vec![1.0; BASE_DIM],
    }
}

/// Eq. 6 for a batch of `rows` transitions with [`loss_weights`]; a demo has `mean_length` on average.
pub(super) fn model_loss<'a>(dynamics: &Dynamics, weights: &'a [f32], rows: usize, mean_length: f32) -> Loss<'a> {
    let kind = dynamics.settings().loss;
    let scale = match kind {
        ModelLoss::RawSum => mean_length / rows as f32,
        _ => 1.0 / (rows * BASE_DIM) as f32,
    };
    Loss { weights, scale, huber: kind == ModelLoss::StandardisedHuber }
}

/// How an epoch is cut into updates.
pub(super) struct Batches<'a> {
    corpus: &'a Corpus,
    /// Transitions per update; 0 = one whole demo.
    rows: usize,
}

impl<'a> Batches<'a> {
    pub fn new(corpus: &'a Corpus, rows: usize) -> Self {
        Batches { corpus, rows: rows.min(corpus.rows()) }
    }

    /// Updates in an epoch; transitions that do not fill a batch wait for the next shuffle.
    pub fn per_epoch(&self) -> u64 {
        self.corpus.rows().checked_div(self.rows).unwrap_or(self.corpus.demos()) as u64
    }

    /// The batches of one epoch, in random order.
    pub fn shuffled(&self, rng: &mut impl rand::Rng) -> Epoch {
        let transitions = self.corpus.rows();
        if let Some(count) = transitions.checked_div(self.rows) {
            let mut rows: Vec<usize> = (0..transitions).collect();
            rows.shuffle(rng);
            return Epoch { rows, ends: (1..=count).map(|i| i * self.rows).collect() };
        }
        let mut order: Vec<usize> = (0..self.corpus.demos()).collect();
        order.shuffle(rng);
        let mut epoch = Epoch { rows: Vec::with_capacity(transitions), ends: Vec::with_capacity(order.len()) };
        for demo in order {
            epoch.rows.extend(self.corpus.demo(demo));
            epoch.ends.push(epoch.rows.len());
        }
        epoch
    }
}

/// The batches of one epoch side by side.
pub(super) struct Epoch {
    rows: Vec<usize>,
    ends: Vec<usize>,
}

impl Epoch {
    /// The transitions of each batch.
    pub fn iter(&self) -> impl Iterator<Item = &[usize]> {
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| &self.rows[start..*end])
    }
}
