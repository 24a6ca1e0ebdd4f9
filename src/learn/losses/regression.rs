//! Supervised learning of a network by minibatches, in shards: how the dynamics network learns from observed transitions (Eq. 6).

use super::shards;
use crate::learn::models::Samples;
use crate::nn::{BLOCK_PANELS, LANES, Lanes, Mlp, Pass, panels_of};
use rayon::prelude::*;

/// Where Huber's function turns from a parabola into a line, in standard deviations.
const HUBER_KNEE: f32 = 1.0;

/// sum over rows and entries of scale * weight_i * loss(error_i).
#[derive(Clone, Copy, Debug)]
pub struct Loss<'a> {
    /// Weight of each entry.
    pub weights: &'a [f32],
    /// Factor of the sum.
    pub scale: f32,
    /// Huber's function instead of the square.
    pub huber: bool,
}

/// The workspace, and the gradient of the last batch.
#[derive(Default)]
pub struct Regression {
    shards: Vec<Shard>,
    /// Gradient with respect to the parameters.
    pub gradient: Vec<f32>,
}

#[derive(Default)]
struct Shard {
    pass: Pass,
    loss: f64,
}

impl Regression {
    /// Loss of the network on `rows` of `samples`; with `learn`, its gradient too.
    pub fn loss(&mut self, net: &Mlp, samples: &impl Samples, rows: &[usize], loss: &Loss, learn: bool) -> f64 {
        let active = shards::count(rows.len());
        self.shards.resize_with(shards::MAX_SHARDS, Shard::default);
        self.shards.iter_mut().for_each(|shard| shard.grow(net));
        self.shards[..active].par_iter_mut().enumerate().for_each(|(i, shard)| {
            shard.run(net, samples, &rows[shards::range(rows.len(), active, i)], loss, learn);
        });
        if learn {
            self.gradient.resize(net.params().len(), 0.0);
            net.finish_gradient(self.shards[..active].iter_mut().map(|shard| &mut shard.pass), &mut self.gradient);
        }
        self.shards[..active].iter().map(|shard| shard.loss).sum()
    }
}

impl Shard {
    fn grow(&mut self, net: &Mlp) {
        self.pass.reserve(net, BLOCK_PANELS);
        self.pass.grow(net, BLOCK_PANELS);
    }

    fn run(&mut self, net: &Mlp, samples: &impl Samples, rows: &[usize], loss: &Loss, learn: bool) {
        self.loss = 0.0;
        net.begin_gradient(&mut self.pass);
        for rows in rows.chunks(BLOCK_PANELS * LANES) {
            self.block(net, samples, rows, loss, learn);
        }
    }

    fn block(&mut self, net: &Mlp, samples: &impl Samples, rows: &[usize], loss: &Loss, learn: bool) {
        let panels = panels_of(rows.len());
        samples.write_inputs(rows, &mut self.pass.input);
        net.forward(&mut self.pass, 0..panels);
        for (p, rows) in rows.chunks(LANES).enumerate() {
            self.panel_loss(samples, p, rows, loss);
        }
        if learn {
            net.learn(&mut self.pass, 0..panels);
        }
    }

    /// Loss of one panel, and its gradient; lanes without a row have no error.
    fn panel_loss(&mut self, samples: &impl Samples, p: usize, rows: &[usize], loss: &Loss) {
        let (output, d_output) = (self.pass.output.panel(p), self.pass.d_output.panel_mut(p));
        samples.write_targets(rows, d_output);
        if rows.len() < LANES {
            d_output.iter_mut().zip(output).for_each(|(target, output)| target.take_from(rows.len(), *output));
        }
        let mut sum = Lanes::default();
        for ((d, output), weight) in d_output.iter_mut().zip(output).zip(loss.weights) {
            let error = *output - *d;
            let bent = bend(error, knee(loss.huber));
            sum += bent * (error * 2.0 - bent) * *weight;
            *d = bent * (2.0 * loss.scale * weight);
        }
        self.loss += sum.0.iter().map(|sum| f64::from(loss.scale * sum)).sum::<f64>();
    }
}

/// Where the loss turns into a line: never, if it is the square.
fn knee(huber: bool) -> f32 {
    if huber { HUBER_KNEE } else { f32::INFINITY }
}

/// Huber's function is a parabola up to `knee`, and its tangent from there: half its derivative, from which the function itself is
/// bent (2 error - bent).
#[inline]
pub(super) fn bend(error: Lanes, knee: f32) -> Lanes {
    error.map(|e| {
        if e > knee {
            knee
        } else if e < -knee {
            -knee
        } else {
            e
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::models::row;
    use crate::nn::{Activation, Panels, kernel};
    use crate::seed::stream;
    use rand::RngExt;

    struct Table {
        inputs: Vec<f32>,
        targets: Vec<f32>,
    }

    impl Samples for Table {
        fn write_inputs(&self, rows: &[usize], to: &mut Panels) {
            to.write_rows(0, rows.len(), |slot| row(&self.inputs, 3, rows[slot]));
        }

        fn write_targets(&self, rows: &[usize], panel: &mut [Lanes]) {
            kernel::interleave(panel, std::array::from_fn(|lane| row(&self.targets, 2, rows[lane.min(rows.len() - 1)])));
        }
    }

    #[test]
    fn gradients_of_square_and_huber_equal_finite_differences() {
        let mut rng = stream(3, "regression", 0);
        let mut net = Mlp::new(&[3, 8, 2], Activation::Tanh, &mut rng);
        let mut random = |n: usize, size: f32| -> Vec<f32> { (0..n).map(|_| size * (rng.random::<f32>() - 0.5)).collect() };
        let samples = Table { inputs: random(200 * 3, 2.0), targets: random(200 * 2, 6.0) };
        let rows: Vec<usize> = (0..200).collect();
        for huber in [false, true] {
            let loss = Loss { weights: &[1.0, 0.5], scale: 1.0 / 400.0, huber };
            let mut work = Regression::default();
            work.loss(&net, &samples, &rows, &loss, true);
            let gradient = work.gradient.clone();
            for (i, analytic) in gradient.iter().enumerate() {
                let mut at = |h: f32| {
                    net.params_mut()[i] += h;
                    let value = work.loss(&net, &samples, &rows, &loss, false);
                    net.params_mut()[i] -= h;
                    value
                };
                let numeric = (at(1e-2) - at(-1e-2)) / 2e-2;
                assert!((numeric - f64::from(*analytic)).abs() < 2e-3, "huber {huber}, {i}: {analytic} against {numeric}");
            }
        }
    }
}
