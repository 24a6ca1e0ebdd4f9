//! The state of training at the end of an epoch as named arrays and a description, and back: with it training goes on as if it had
//! never stopped. Floats of the networks are arrays; counts and metrics, which f32 cannot hold, go into the description.

use super::hil::Averages;
use super::learner::{Descent, Learner};
use super::metrics::EpochMetrics;
use super::past;
use super::policy::Policy;
use super::selection::Selection;
use super::weights::{Reader, vector};
use crate::error::Error;
use crate::nn::{Adam, Ema};
use crate::tensor::NamedTensor;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// What training needs to go on after an epoch, beside demos, dynamics network, settings and seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// All arrays.
    pub tensors: Vec<NamedTensor>,
    /// All that is not an array; its entry `after` says in words where training stands.
    pub meta: Value,
}

/// What a [`Checkpoint`] says of the run, beside the learner's own state.
pub(super) struct History {
    pub rows: Vec<EpochMetrics>,
    pub selection: Selection,
    /// The policy that the selection prefers.
    pub best: Option<Policy>,
}

/// The learner between two epochs.
pub(super) struct State {
    tensors: Vec<NamedTensor>,
    counts: Counts,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Counts {
    pub updates: u64,
    pub draws: u64,
    pub skipped: u64,
    pub net: Steps,
    pub std: Steps,
    /// One an ensemble member.
    pub model_adam: Option<Vec<u32>>,
    pub averages: Averages,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Steps {
    pub adam: u32,
    pub ema: u32,
}

const NET: &str = "policy.net";
const STD: &str = "policy.log_std";
const MODEL: &str = "dynamics.net";
const BEST_NET: &str = "best.net";
const BEST_STD: &str = "best.log_std";

impl Checkpoint {
    pub(super) fn new(state: &State, history: &History) -> Self {
        let mut tensors = state.tensors.clone();
        if let Some(best) = &history.best {
            tensors.extend([vector(BEST_NET, best.net.params()), vector(BEST_STD, &best.log_std)]);
        }
        let History { rows, selection, .. } = history;
        let after = rows.last().map(EpochMetrics::place).unwrap_or_default();
        Checkpoint { tensors, meta: json!({ "after": after, "counts": state.counts, "selection": selection, "epochs": rows }) }
    }

    /// Where training stands, in words: "hil epoch 3 of 60".
    pub fn after(&self) -> &str {
        self.meta.get("after").and_then(Value::as_str).unwrap_or("an unknown epoch")
    }

    /// Puts a fresh learner of the same run into the state; what else the run knows comes back.
    ///
    /// # Errors
    /// Says what is missing or does not fit.
    pub(super) fn restore(&self, learner: &mut Learner) -> Result<(State, History), String> {
        let reader = Reader { tensors: &self.tensors, meta: &self.meta };
        let counts: Counts = reader.meta("counts")?;
        let mut history = History { rows: reader.meta("epochs")?, selection: reader.meta("selection")?, best: None };
        past::check(&counts, &history)?;
        learner.restore(&reader, &counts)?;
        if history.selection.best().is_some() {
            let mut best = learner.policy.clone();
            best.net.params_mut().copy_from_slice(&reader.tensor(BEST_NET, &[learner.policy.net.params().len()])?);
            best.log_std = reader.log_std(BEST_STD)?;
            history.best = Some(best);
        }
        Ok((learner.state(counts.averages), history))
    }
}

impl State {
    /// The averages of the mixing.
    pub fn averages(&self) -> Averages {
        self.counts.averages
    }

    /// Whether every number of the state is one.
    ///
    /// # Errors
    /// [`Error::Failed`] names the network that diverged, the epoch and what to change.
    pub fn check(&self, row: &EpochMetrics) -> Result<(), Error> {
        let Some(bad) = self.tensors.iter().find(|t| t.data.iter().any(|v| !v.is_finite())) else { return Ok(()) };
        let (network, remedy) = if bad.name.starts_with(MODEL) {
            ("the dynamics network (Eq. 6)", "lower train.dynamics_learning_rate")
        } else {
            ("the policy (L_mix, Eq. 1)", "lower train.learning_rate or train.warm_start_learning_rate, or set train.clip_norm")
        };
        Err(Error::Failed(format!("{network} is no longer finite after {}: {remedy}", row.place())))
    }
}

impl Learner {
    /// All that changes from update to update; `averages` are the mixing's part of it.
    pub(super) fn state(&self, averages: Averages) -> State {
        let mut tensors = vec![vector(NET, self.policy.net.params()), vector(STD, &self.policy.log_std)];
        push_descent(&mut tensors, NET, &self.net_descent);
        push_descent(&mut tensors, STD, &self.std_descent);
        if let Some(model) = &self.model {
            let nets = [&model.dynamics.net].into_iter().chain(&model.dynamics.others);
            for (i, (net, adam)) in nets.zip(&model.adams).enumerate() {
                tensors.push(vector(&member(i), net.params()));
                push_adam(&mut tensors, &member(i), adam);
            }
        }
        let counts = Counts {
            updates: self.updates,
            draws: self.draws,
            skipped: self.skipped,
            net: self.net_descent.steps(),
            std: self.std_descent.steps(),
            model_adam: self.model.as_ref().map(|model| model.adams.iter().map(|adam| adam.state().2).collect()),
            averages,
        };
        State { tensors, counts }
    }

    fn restore(&mut self, reader: &Reader, counts: &Counts) -> Result<(), String> {
        let (net, std) = (self.policy.net.params().len(), self.policy.log_std.len());
        self.policy.net.params_mut().copy_from_slice(&reader.tensor(NET, &[net])?);
        self.policy.log_std = reader.log_std(STD)?;
        self.net_descent = descent(reader, NET, net, self.settings.ema_decay, counts.net)?;
        self.std_descent = descent(reader, STD, std, self.settings.ema_decay, counts.std)?;
        if let Some(model) = &mut self.model {
            let steps = counts.model_adam.as_ref().ok_or("it was made without a dynamics network")?;
            if steps.len() != model.adams.len() {
                return Err(format!("it has {} dynamics networks, this run {}", steps.len(), model.adams.len()));
            }
            let len = model.dynamics.net.params().len();
            let nets = [&mut model.dynamics.net].into_iter().chain(&mut model.dynamics.others);
            for (i, (net, (state, steps))) in nets.zip(model.adams.iter_mut().zip(steps)).enumerate() {
                net.params_mut().copy_from_slice(&reader.tensor(&member(i), &[len])?);
                *state = adam(reader, &member(i), len, *steps)?;
            }
        }
        (self.updates, self.draws, self.skipped) = (counts.updates, counts.draws, counts.skipped);
        self.update_averaged();
        Ok(())
    }
}

/// Name of the tensors of the dynamics networks, that in use first.
fn member(i: usize) -> String {
    if i == 0 { MODEL.into() } else { format!("{MODEL}.{}", i + 1) }
}

impl Descent {
    fn steps(&self) -> Steps {
        Steps { adam: self.adam.state().2, ema: self.ema.updates() }
    }
}

fn push_adam(out: &mut Vec<NamedTensor>, name: &str, adam: &Adam) {
    let (first, second, _) = adam.state();
    out.extend([vector(&format!("{name}.first_moment"), first), vector(&format!("{name}.second_moment"), second)]);
}

fn push_descent(out: &mut Vec<NamedTensor>, name: &str, descent: &Descent) {
    push_adam(out, name, &descent.adam);
    out.push(vector(&format!("{name}.average"), descent.ema.average()));
}

fn adam(reader: &Reader, name: &str, len: usize, steps: u32) -> Result<Adam, String> {
    let first = reader.tensor(&format!("{name}.first_moment"), &[len])?;
    let second = reader.tensor(&format!("{name}.second_moment"), &[len])?;
    match second.iter().find(|v| **v < 0.0) {
        Some(v) => Err(format!("tensor {name}.second_moment holds {v}; means of squares are 0 or more")),
        None => Ok(Adam::from_state(first, second, steps)),
    }
}

fn descent(reader: &Reader, name: &str, len: usize, decay: f64, steps: Steps) -> Result<Descent, String> {
    let average = reader.tensor(&format!("{name}.average"), &[len])?;
    Ok(Descent { adam: adam(reader, name, len, steps.adam)?, ema: Ema::from_state(average, decay, steps.ema) })
}
