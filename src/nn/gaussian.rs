//! The spread of a diagonal Gaussian whose mean is a network's output: one free log standard deviation an output.

use crate::math::{exp, exp_f32, ln};

/// Keeps every log standard deviation at or above `floor`.
pub fn floor_log_std(log_std: &mut [f32], floor: f32) {
    log_std.iter_mut().for_each(|v| *v = v.max(floor));
}

/// Mean negative log-likelihood of residuals, up to a constant: mean_i (log sigma_i + r2_i / (2 sigma_i^2)), with `r2` the mean
/// square residual of each output. The gradient goes to the spread alone.
pub fn nll(log_std: &[f32], r2: &[f32]) -> f32 {
    let terms = log_std.iter().zip(r2).map(|(l, r2)| l + 0.5 * r2 * exp_f32(-2.0 * l));
    terms.sum::<f32>() / log_std.len() as f32
}

/// Adds the gradient of [`nll`] with respect to the log standard deviations to `d_log_std`.
pub fn add_nll_gradient(log_std: &[f32], r2: &[f32], d_log_std: &mut [f32]) {
    let n = log_std.len() as f32;
    for ((d, l), r2) in d_log_std.iter_mut().zip(log_std).zip(r2) {
        *d += (1.0 - r2 * exp_f32(-2.0 * l)) / n;
    }
}

/// Density of the point mean + sigma * eps under the Gaussian itself; `unit` is the size of each output's unit.
pub fn sample_density(log_std: &[f32], unit: &[f32], eps: impl Iterator<Item = f32>) -> f64 {
    let half_log_two_pi = 0.5 * ln(2.0 * std::f64::consts::PI);
    let terms = log_std.iter().zip(unit).zip(eps);
    let log_density = terms.map(|((l, u), e)| -f64::from(e * e) / 2.0 - f64::from(*l) - ln(f64::from(*u)) - half_log_two_pi);
    exp(log_density.sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nll_gradient_equals_finite_differences() {
        let (log_std, r2) = ([-1.0f32, 0.2, -0.5], [0.3f32, 0.9, 0.1]);
        let mut gradient = [0.0; 3];
        add_nll_gradient(&log_std, &r2, &mut gradient);
        for i in 0..3 {
            let at = |h: f32| {
                let mut moved = log_std;
                moved[i] += h;
                nll(&moved, &r2)
            };
            let numeric = (at(1e-2) - at(-1e-2)) / 2e-2;
            assert!((numeric - gradient[i]).abs() < 1e-3, "{} against {numeric}", gradient[i]);
        }
    }

    #[test]
    fn density_of_the_mean_of_a_unit_gaussian() {
        let density = sample_density(&[0.0], &[1.0], [0.0].into_iter());
        assert!((density - 0.398_942_28).abs() < 1e-6);
    }
}
