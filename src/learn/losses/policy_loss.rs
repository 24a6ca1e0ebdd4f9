//! A loss of the policy with its gradient, and weighted sums of such losses: Eq. 1 is written with them.

use super::shards;
use crate::nn::{Lanes, Panels, panels_of};
use crate::state::JOINTS;
use std::ops::{Add, Mul};

/// A loss, and its gradient in parts: what it sends back to the mean actions in the demos' states goes through the policy's network in
/// one backward pass, together with that of the losses that it is mixed with ([`super::Acted::gradient`]).
#[derive(Default)]
pub struct PolicyLoss {
    /// The loss, for example "L_BC (Eq. 3)".
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Gradient with respect to the standardised mean actions in the demos' states, one array a shard.
    pub d_mean: Vec<Panels>,
    /// Gradient with respect to the network's parameters on other ways than those actions; empty when there are none.
    pub d_params: Vec<f32>,
    /// Gradient with respect to the log standard deviations.
    pub d_log_std: [f32; JOINTS],
    /// Gradient of the likelihood that teaches the log standard deviations where the loss does not: no weight mixes it away.
    pub d_likelihood: [f32; JOINTS],
}

impl PolicyLoss {
    /// Of this name, with room for batches of at most `most_rows` states.
    pub fn new(name: &'static str, most_rows: usize) -> Self {
        let mut loss = PolicyLoss { name, ..PolicyLoss::default() };
        loss.d_mean.resize_with(shards::MAX_SHARDS, Panels::default);
        loss.d_mean.iter_mut().for_each(|d| d.provide(JOINTS, panels_of(shards::most_rows(most_rows))));
        loss
    }

    /// No gradient yet, for a batch of `rows` states.
    pub fn begin(&mut self, rows: usize) {
        (self.value, self.d_log_std, self.d_likelihood) = (0.0, [0.0; JOINTS], [0.0; JOINTS]);
        let count = shards::count(rows);
        for (i, d_mean) in self.d_mean[..count].iter_mut().enumerate() {
            let panels = panels_of(shards::range(rows, count, i).len());
            d_mean.reserve(JOINTS, panels);
            d_mean.span_mut(&(0..panels)).fill(Lanes::default());
        }
    }
}

/// A weighted sum of losses: its value, and what is to be descended. Nothing is worked out before it is asked for.
#[derive(Clone, Copy)]
pub struct Mixture<'a> {
    terms: [Option<(f64, &'a PolicyLoss)>; 2],
}

impl<'a> Mul<&'a PolicyLoss> for f64 {
    type Output = Mixture<'a>;
    fn mul(self, loss: &'a PolicyLoss) -> Mixture<'a> {
        Mixture { terms: [Some((self, loss)), None] }
    }
}

impl Add for Mixture<'_> {
    type Output = Self;
    /// # Panics
    /// With more than two losses in all.
    fn add(self, other: Self) -> Self {
        match (self.terms, other.terms) {
            ([first, None], [second, None]) => Mixture { terms: [first, second] },
            _ => panic!("at most two losses are mixed"),
        }
    }
}

impl<'a> Mixture<'a> {
    /// Weights and losses.
    pub fn terms(self) -> impl Iterator<Item = (f64, &'a PolicyLoss)> {
        self.terms.into_iter().flatten()
    }

    /// The sum of the losses, weighted.
    pub fn value(self) -> f64 {
        self.terms().map(|(weight, loss)| weight * loss.value).sum()
    }

    /// Gradient with respect to the log standard deviations.
    pub fn d_log_std(self) -> [f32; JOINTS] {
        let mut sum = [0.0; JOINTS];
        for (weight, loss) in self.terms() {
            shards::add_scaled(&mut sum, &loss.d_log_std, weight as f32);
            shards::add_scaled(&mut sum, &loss.d_likelihood, 1.0);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixture_weighs_value_and_gradient_but_not_the_likelihood() {
        let of = |value, d: f32| PolicyLoss { value, d_log_std: [d; JOINTS], d_likelihood: [1.0; JOINTS], ..Default::default() };
        let (bc, sc) = (of(2.0, 4.0), of(10.0, 8.0));
        let mixed = 0.75 * &bc + 0.25 * 2.0 * &sc;
        assert_eq!(mixed.value(), 0.75 * 2.0 + 0.5 * 10.0);
        assert_eq!(mixed.d_log_std(), [0.75 * 4.0 + 0.5 * 8.0 + 2.0; JOINTS]);
        assert_eq!((1.0 * &bc).value(), 2.0);
    }
}
