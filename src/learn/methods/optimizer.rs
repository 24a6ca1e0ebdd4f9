//! Adam and the averaged weights of one parameter vector, and both as named arrays.

use crate::learn::models::{Reader, vector};
use crate::learn::run::past::at_most;
use crate::nn::{Adam, Ema};
use crate::tensor::NamedTensor;
use serde::{Deserialize, Serialize};

/// Most steps of an optimiser, which counts them in 32 bits.
const MOST_STEPS: u32 = 1 << 31;

/// A parameter vector's way down.
pub struct Optimizer {
    adam: Adam,
    ema: Ema,
}

/// Steps that an optimiser and its average have made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Steps {
    /// Of Adam.
    pub adam: u32,
    /// Of the average.
    pub ema: u32,
}

impl Optimizer {
    /// Fresh moments; the average starts at `params`.
    pub fn new(params: &[f32], ema_decay: f64) -> Self {
        Optimizer { adam: Adam::new(params.len()), ema: Ema::new(params, ema_decay) }
    }

    /// One step of the parameters down their gradient.
    pub fn step(&mut self, params: &mut [f32], gradient: &[f32], learning_rate: f64) {
        self.adam.step(params, gradient, learning_rate);
    }

    /// Takes the parameters into the average.
    pub fn average(&mut self, params: &[f32]) {
        self.ema.update(params);
    }

    /// The averaged parameters.
    pub fn averaged(&self) -> &[f32] {
        self.ema.average()
    }

    /// What [`Optimizer::restore`] needs beside the arrays.
    pub fn steps(&self) -> Steps {
        Steps { adam: self.adam.state().2, ema: self.ema.updates() }
    }

    /// The arrays, whose names begin with `name`.
    pub fn push(&self, out: &mut Vec<NamedTensor>, name: &str) {
        push_adam(out, name, &self.adam);
        out.push(vector(&format!("{name}.average"), self.ema.average()));
    }

    /// The inverse of [`Optimizer::push`], for `len` parameters.
    ///
    /// # Errors
    /// Says what is missing or does not fit.
    pub fn restore(reader: &Reader, name: &str, len: usize, decay: f64, steps: Steps) -> Result<Self, String> {
        at_most("steps of an average", steps.ema, MOST_STEPS)?;
        let average = reader.tensor(&format!("{name}.average"), &[len])?;
        Ok(Optimizer { adam: read_adam(reader, name, len, steps.adam)?, ema: Ema::from_state(average, decay, steps.ema) })
    }
}

/// Adam's moments, their names beginning with `name`.
pub fn push_adam(out: &mut Vec<NamedTensor>, name: &str, adam: &Adam) {
    let (first, second, _) = adam.state();
    out.extend([vector(&format!("{name}.first_moment"), first), vector(&format!("{name}.second_moment"), second)]);
}

/// The inverse of [`push_adam`].
///
/// # Errors
/// Says what is missing or does not fit.
pub fn read_adam(reader: &Reader, name: &str, len: usize, steps: u32) -> Result<Adam, String> {
    at_most("steps of an optimiser", steps, MOST_STEPS)?;
    let first = reader.tensor(&format!("{name}.first_moment"), &[len])?;
    let second = reader.tensor(&format!("{name}.second_moment"), &[len])?;
    match second.iter().find(|v| **v < 0.0) {
        Some(v) => Err(format!("tensor {name}.second_moment holds {v}; means of squares are 0 or more")),
        None => Ok(Adam::from_state(first, second, steps)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn steps_beyond_what_an_optimiser_counts_are_refused() {
        let (mut tensors, meta) = (Vec::new(), json!({}));
        push_adam(&mut tensors, "net", &Adam::new(2));
        let read = |steps| read_adam(&Reader { tensors: &tensors, meta: &meta }, "net", 2, steps);
        assert!(read(MOST_STEPS).is_ok());
        assert!(read(MOST_STEPS + 1).expect_err("refused").contains("steps of an optimiser"));
    }
}
