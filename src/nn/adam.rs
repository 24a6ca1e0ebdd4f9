//! Adam (Kingma & Ba 2015) on a flat parameter vector, gradient clipping, the cosine schedule, an average of the weights.

use super::kernel::wide;
use crate::math::{cos, pow};

/// Decay of the first moment.
const BETA_1: f32 = 0.9;
/// Decay of the second moment.
const BETA_2: f32 = 0.999;
/// Keeps the step finite where the gradient has always been 0.
const EPSILON: f32 = 1e-8;

/// Moments of one parameter vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    steps: u32,
}

impl Adam {
    /// For `len` parameters.
    pub fn new(len: usize) -> Self {
        Adam { first: vec![0.0; len], second: vec![0.0; len], steps: 0 }
    }

    /// First and second moments, and how many steps made them.
    pub fn state(&self) -> (&[f32], &[f32], u32) {
        (&self.first, &self.second, self.steps)
    }

    /// The inverse of [`Adam::state`].
    ///
    /// # Panics
    /// When the moments differ in length.
    pub fn from_state(first: Vec<f32>, second: Vec<f32>, steps: u32) -> Self {
        assert_eq!(first.len(), second.len(), "a parameter has two moments");
        Adam { first, second, steps }
    }

    /// One step down the gradient.
    pub fn step(&mut self, params: &mut [f32], gradient: &[f32], learning_rate: f64) {
        self.steps += 1;
        let correction = |beta: f32| 1.0 - pow(f64::from(beta), f64::from(self.steps));
        let rate = (learning_rate / correction(BETA_1)) as f32;
        let scale = (1.0 / correction(BETA_2)) as f32;
        let moments = self.first.iter_mut().zip(&mut self.second);
        wide(|| {
            for ((p, g), (m, v)) in params.iter_mut().zip(gradient).zip(moments) {
                *m = BETA_1 * *m + (1.0 - BETA_1) * g;
                *v = BETA_2 * *v + (1.0 - BETA_2) * (g * g);
                *p -= rate * *m / ((*v * scale).sqrt() + EPSILON);
            }
        });
    }
}

/// Euclidean norm, summed in f64: several sums side by side, which need not wait for each other.
pub fn global_norm(gradient: &[f32]) -> f64 {
    const SUMS: usize = 8;
    let (chunks, rest) = gradient.as_chunks::<SUMS>();
    let mut sums = [0.0f64; SUMS];
    wide(|| {
        for chunk in chunks {
            sums.iter_mut().zip(chunk).for_each(|(sum, g)| *sum += f64::from(*g).powi(2));
        }
    });
    sums.iter_mut().zip(rest).for_each(|(sum, g)| *sum += f64::from(*g).powi(2));
    sums.iter().sum::<f64>().sqrt()
}

/// Scales the gradient down to norm `limit` if it is longer (0 = leave it) and returns the norm it had.
pub fn clip_by_global_norm(gradient: &mut [f32], limit: f64) -> f64 {
    let norm = global_norm(gradient);
    if limit > 0.0 && norm > limit && norm.is_finite() {
        let factor = (limit / norm) as f32;
        wide(|| gradient.iter_mut().for_each(|g| *g *= factor));
    }
    norm
}

/// Learning rate at `step` of `steps`: from `first` to `last` along half a cosine.
pub fn cosine(first: f64, last: f64, step: u64, steps: u64) -> f64 {
    let progress = step.min(steps) as f64 / steps.max(1) as f64;
    last + 0.5 * (first - last) * (1.0 + cos(std::f64::consts::PI * progress))
}

/// Exponential moving average of a parameter vector. It starts as a plain average, so that early weights are soon forgotten.
#[derive(Clone, Debug, PartialEq)]
pub struct Ema {
    average: Vec<f32>,
    decay: f32,
    updates: u32,
}

/// The average over the first updates spans about a tenth of them.
const EMA_WARM_UP: f32 = 10.0;

impl Ema {
    /// Starts at `params`; a `decay` of 0 follows them exactly.
    pub fn new(params: &[f32], decay: f64) -> Self {
        Ema { average: params.to_vec(), decay: decay as f32, updates: 0 }
    }

    /// How many updates the average has seen.
    pub fn updates(&self) -> u32 {
        self.updates
    }

    /// An average that has seen `updates` of them.
    pub fn from_state(average: Vec<f32>, decay: f64, updates: u32) -> Self {
        Ema { average, decay: decay as f32, updates }
    }

    /// Takes in the parameters after an update.
    pub fn update(&mut self, params: &[f32]) {
        self.updates += 1;
        let n = self.updates as f32;
        let keep = self.decay.min((1.0 + n) / (EMA_WARM_UP + n));
        wide(|| self.average.iter_mut().zip(params).for_each(|(a, p)| *a = keep * *a + (1.0 - keep) * p));
    }

    /// The average.
    pub fn average(&self) -> &[f32] {
        &self.average
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adam_finds_the_bottom_of_a_bowl() {
        let (mut params, mut adam) = (vec![3.0f32, -2.0], Adam::new(2));
        for step in 0..2000 {
            let gradient = [2.0 * (params[0] - 1.0), 20.0 * (params[1] + 0.5)];
            adam.step(&mut params, &gradient, cosine(1e-2, 1e-4, step, 2000));
        }
        assert!((params[0] - 1.0).abs() < 1e-3 && (params[1] + 0.5).abs() < 1e-3, "{params:?}");
    }

    #[test]
    fn the_first_step_is_the_learning_rate_long() {
        let (mut params, mut adam) = (vec![0.0f32], Adam::new(1));
        adam.step(&mut params, &[5.0], 1e-3);
        assert!((params[0] + 1e-3).abs() < 1e-7);
    }

    #[test]
    fn clipping_and_schedule() {
        let mut gradient = vec![3.0f32, 4.0];
        assert!((clip_by_global_norm(&mut gradient, 1.0) - 5.0).abs() < 1e-9);
        assert!((global_norm(&gradient) - 1.0).abs() < 1e-6);
        assert!((cosine(1e-3, 1e-5, 0, 10) - 1e-3).abs() < 1e-12 && (cosine(1e-3, 1e-5, 10, 10) - 1e-5).abs() < 1e-12);
    }

    #[test]
    fn the_average_of_a_constant_is_the_constant() {
        let mut ema = Ema::new(&[0.0], 0.5);
        (0..60).for_each(|_| ema.update(&[2.0]));
        assert!((ema.average()[0] - 2.0).abs() < 1e-5);
        let mut off = Ema::new(&[0.0], 0.0);
        off.update(&[2.0]);
        assert_eq!(off.average(), [2.0]);
    }
}
