//! What networks learn from the transitions of a corpus, batch by batch.

use super::corpus::Corpus;
use super::dynamics::Dynamics;
use super::policy::Policy;
use crate::nn::{LANES, Lanes, Panels, kernel};
use std::array::from_fn;

/// Inputs and targets of a network, worked out when they are asked for: kept for all transitions they would take more memory than the
/// demos.
pub trait Samples: Sync {
    /// Writes the network's inputs in transitions `rows`, from the first panel on; zero in lanes without one.
    fn write_inputs(&self, rows: &[usize], to: &mut Panels);

    /// Writes what it must put out in up to eight transitions; the last is repeated in lanes without one.
    fn write_targets(&self, rows: &[usize], panel: &mut [Lanes]);
}

/// What behavior cloning learns: the policy's inputs and the standardised commanded actions.
#[derive(Clone, Copy)]
pub struct PolicySamples<'a> {
    /// The demos.
    pub corpus: &'a Corpus,
    /// The policy, which knows its features and the scaling of its actions.
    pub policy: &'a Policy,
}

impl Samples for PolicySamples<'_> {
    fn write_inputs(&self, rows: &[usize], to: &mut Panels) {
        self.policy.features().write_transitions(self.corpus, rows.len(), |i| rows[i], to);
    }

    fn write_targets(&self, rows: &[usize], panel: &mut [Lanes]) {
        kernel::interleave(panel, from_fn(|lane| self.corpus.commanded(rows[lane.min(rows.len() - 1)])));
        let scaling = self.policy.action_scaling();
        panel.iter_mut().enumerate().for_each(|(i, slot)| *slot = slot.map(|a| scaling.apply(i, a)));
    }
}

/// What the dynamics network learns from the observed transitions: its inputs, and what it must add, standardised.
pub struct ModelSamples<'a> {
    /// The demos.
    pub corpus: &'a Corpus,
    /// The network, which knows its features and scalings.
    pub dynamics: &'a Dynamics,
}

impl Samples for ModelSamples<'_> {
    fn write_inputs(&self, rows: &[usize], to: &mut Panels) {
        let (corpus, features) = (self.corpus, self.dynamics.features());
        features.write_transitions(corpus, rows.len(), |i| rows[i], to);
        for (p, rows) in rows.chunks(LANES).enumerate() {
            let given = &mut to.panel_mut(p)[features.width()..];
            kernel::interleave(given, from_fn(|lane| corpus.executed(rows[lane.min(rows.len() - 1)])));
            self.dynamics.scale_action(given);
        }
        to.clear_tail(rows.len());
    }

    fn write_targets(&self, rows: &[usize], panel: &mut [Lanes]) {
        let rows: [usize; LANES] = from_fn(|lane| rows[lane.min(rows.len() - 1)]);
        let of = rows.map(|r| (self.corpus.state(r), self.corpus.executed(r), self.corpus.next(r)));
        for (i, slot) in panel.iter_mut().enumerate() {
            *slot = Lanes(of.map(|(state, action, next)| self.dynamics.residual(i, state, action, next)));
        }
    }
}
