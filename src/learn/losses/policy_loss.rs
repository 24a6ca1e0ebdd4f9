//! A loss of the policy with its gradient, and weighted sums of such losses: Eq. 1 is written with them.

use super::shards;
use crate::nn::{Lanes, Panels, panels_of};
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
    pub d_log_std: Vec<f32>,
    /// Gradient of the likelihood that teaches the log standard deviations where the loss does not: no weight mixes it away.
    pub d_likelihood: Vec<f32>,
}

impl PolicyLoss {
    /// Of this name, for actions of `dim` entries, with room for batches of at most `most_rows` states.
    pub fn new(name: &'static str, dim: usize, most_rows: usize) -> Self {
        let (d_log_std, d_likelihood) = (vec![0.0; dim], vec![0.0; dim]);
        let mut loss = PolicyLoss { name, d_log_std, d_likelihood, ..PolicyLoss::default() };
        loss.d_mean.resize_with(shards::MAX_SHARDS, Panels::default);
        loss.d_mean.iter_mut().for_each(|d| d.reserve(dim, panels_of(shards::most_rows(most_rows))));
        loss
    }

    /// No gradient yet, for a batch of `rows` states.
    pub fn begin(&mut self, rows: usize) {
        self.value = 0.0;
        self.d_log_std.fill(0.0);
        self.d_likelihood.fill(0.0);
        let count = shards::count(rows);
        for (i, d_mean) in self.d_mean[..count].iter_mut().enumerate() {
            let panels = panels_of(shards::range(rows, count, i).len());
            d_mean.grow(self.d_log_std.len(), panels);
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

    /// Writes the gradient with respect to the log standard deviations into `sum`.
    pub fn d_log_std(self, sum: &mut [f32]) {
        sum.fill(0.0);
        for (weight, loss) in self.terms() {
            shards::add_scaled(sum, &loss.d_log_std, weight as f32);
            shards::add_scaled(sum, &loss.d_likelihood, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixture_weighs_value_and_gradient_but_not_the_likelihood() {
        let of = |value, d: f32| PolicyLoss { value, d_log_std: vec![d; 2], d_likelihood: vec![1.0; 2], ..Default::default() };
        let (bc, sc) = (of(2.0, 4.0), of(10.0, 8.0));
        let mixed = 0.75 * &bc + 0.25 * 2.0 * &sc;
        assert_eq!(mixed.value(), 0.75 * 2.0 + 0.5 * 10.0);
        let mut d_log_std = [7.0; 2];
        mixed.d_log_std(&mut d_log_std);
        assert_eq!(d_log_std, [0.75 * 4.0 + 0.5 * 8.0 + 2.0; 2]);
        assert_eq!((1.0 * &bc).value(), 2.0);
    }
}
