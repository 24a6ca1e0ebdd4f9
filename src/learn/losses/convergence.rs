//! The degree of policy convergence d_conv (Eq. 4): the mean of p_t over the states of the demos.

use crate::config::Convergence;
use crate::learn::models::Policy;
use crate::math::exp_f32;
use crate::nn::gaussian;

/// p_t in one state. `error2` is the squared distance of the mean action from the demo's, standardised; `eps` gives, by the action's entry,
/// the standard normal number that the action was sampled with, and is asked only where p_t is the density of that sample.
pub fn p_t(convergence: Convergence, tau: f32, policy: &Policy, error2: f32, eps: impl Fn(usize) -> f32) -> f64 {
    let unit = &policy.action_scaling().std;
    match convergence {
        Convergence::SampledDensity => gaussian::sample_density(&policy.log_std, unit, (0..unit.len()).map(eps)),
        Convergence::Agreement => f64::from(exp_f32(-0.5 * error2 / (unit.len() as f32 * tau * tau))),
    }
}
