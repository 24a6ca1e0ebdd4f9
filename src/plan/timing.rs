//! Time along a path: the fastest speed profile that the joints' velocity and acceleration limits allow, from rest to rest.

use super::smooth::Limits;
use crate::config::MOST_STEPS;
use crate::joints::Joints;
use crate::state::CONTROL_DT_S;

/// Points between two samples of the path, by cubic interpolation.
const REFINE: usize = 4;
/// Share of the acceleration limits that curvature may use; the rest is for speeding up and braking.
const CURVATURE_SHARE: f64 = 0.6;
/// Share of the limits that the profile uses: the smoother needs room to round it off.
const RESERVE: f64 = 0.92;
/// Below this change per sample a joint stands still \[rad\].
const STILL_RAD: f64 = 1e-9;

/// Samples the path at the control rate, `stretch` times slower than the fastest profile; first and last sample are its ends. The number
/// of control steps as an error when more than [`MOST_STEPS`], which nothing could execute.
pub(super) fn time(path: &[Joints], limits: &Limits, stretch: f64) -> Result<Vec<Joints>, f64> {
    let points = refine(path);
    let speed = profile(&points, limits);
    let mut clock = vec![0.0; points.len()];
    for i in 1..points.len() {
        clock[i] = clock[i - 1] + 2.0 / (speed[i - 1] + speed[i]);
    }
    let total = clock[points.len() - 1];
    let steps = (total * stretch / CONTROL_DT_S).ceil().max(1.0);
    // Also when the limits are so small that the time is no number.
    if !total.is_finite() || steps > f64::from(MOST_STEPS) {
        return Err(steps);
    }
    let steps = steps as usize;
    let (mut samples, mut cell) = (Vec::with_capacity(steps + 1), 0);
    for k in 0..=steps {
        let t = total * k as f64 / steps as f64;
        while cell + 2 < points.len() && clock[cell + 1] < t {
            cell += 1;
        }
        // Constant acceleration within a cell.
        let (spent, v0, v1) = (t - clock[cell], speed[cell], speed[cell + 1]);
        let rate = (v1 - v0) / (clock[cell + 1] - clock[cell]);
        let share = (v0 * spent + rate * spent * spent / 2.0).clamp(0.0, 1.0);
        samples.push(Joints::from_fn(path[0].len(), |j| points[cell][j] + share * (points[cell + 1][j] - points[cell][j])));
    }
    samples[steps] = path[path.len() - 1];
    Ok(samples)
}

/// Catmull-Rom interpolation.
fn refine(path: &[Joints]) -> Vec<Joints> {
    let last = path.len() - 1;
    let mut points = Vec::with_capacity(last * REFINE + 1);
    for i in 0..last {
        let [a, b, c, d] = [path[i.saturating_sub(1)], path[i], path[i + 1], path[(i + 2).min(last)]];
        for k in 0..REFINE {
            let t = k as f64 / REFINE as f64;
            points.push(Joints::from_fn(b.len(), |j| {
                let (m0, m1) = ((c[j] - a[j]) / 2.0, (d[j] - b[j]) / 2.0);
                let bend = 3.0 * (c[j] - b[j]) - 2.0 * m0 - m1;
                b[j] + t * (m0 + t * (bend + t * (m0 + m1 - 2.0 * (c[j] - b[j]))))
            }));
        }
    }
    points.push(path[last]);
    points
}

/// Speed at each point \[points/s\]: limited by velocity and curvature, then by acceleration forward and by braking backward.
fn profile(points: &[Joints], limits: &Limits) -> Vec<f64> {
    let last = points.len() - 1;
    let slope = |i: usize, j: usize| ((points[(i + 1).min(last)][j] - points[i.saturating_sub(1)][j]) / 2.0).abs();
    let bend = |i: usize, j: usize| {
        if i == 0 || i == last { 0.0 } else { (points[i + 1][j] - 2.0 * points[i][j] + points[i - 1][j]).abs() }
    };
    let moves = |i: usize, j: usize| (points[(i + 1).min(last)][j] - points[i.saturating_sub(1)][j]).abs() > STILL_RAD;
    let velocity = |j: usize| RESERVE * limits.velocity[j];
    let acceleration = |j: usize| RESERVE * limits.acceleration[j];
    let ceiling = |i: usize| {
        (0..points[0].len()).filter(|j| moves(i, *j)).fold(f64::INFINITY, |least, j| {
            let by_bend = (CURVATURE_SHARE * acceleration(j) / bend(i, j)).sqrt();
            least.min(velocity(j) / slope(i, j)).min(by_bend)
        })
    };
    // Gain of squared speed per point: 2 x the acceleration left beside curvature.
    let gain = |i: usize, v: f64| {
        (0..points[0].len()).filter(|j| moves(i, *j)).fold(f64::INFINITY, |least, j| {
            let left = (acceleration(j) - bend(i, j) * v * v).max((1.0 - CURVATURE_SHARE) * acceleration(j));
            least.min(2.0 * left / slope(i, j).max(STILL_RAD))
        })
    };
    let mut speed: Vec<f64> = (0..=last).map(ceiling).collect();
    (speed[0], speed[last]) = (0.0, 0.0);
    for i in 1..=last {
        speed[i] = speed[i].min((speed[i - 1].powi(2) + gain(i.min(last - 1), speed[i - 1])).sqrt());
    }
    for i in (0..last).rev() {
        speed[i] = speed[i].min((speed[i + 1].powi(2) + gain(i.max(1), speed[i + 1])).sqrt());
    }
    speed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_takes_the_time_of_a_trapezoid() {
        let limits = Limits::alike(9, 0.5, 2.0);
        let path: Vec<Joints> = (0..=20).map(|k| [k as f64 * 0.05; 9].into()).collect();
        let samples = time(&path, &limits, 1.0).expect("short enough");
        let (v, a) = (0.5 * RESERVE, 2.0 * RESERVE);
        let expected = 1.0 / v + v / a;
        let taken = (samples.len() - 1) as f64 * CONTROL_DT_S;
        assert!((taken - expected).abs() < 0.08, "{taken} s against {expected} s");
        assert!(samples.windows(2).all(|w| w[1][0] >= w[0][0] && w[1][0] - w[0][0] < 0.5 * CONTROL_DT_S));
        assert_eq!((samples[0], samples[samples.len() - 1]), (path[0], path[20]));
    }

    /// Each would otherwise take all memory there is.
    #[test]
    fn a_path_that_takes_longer_than_can_be_executed_is_given_up_before_it_is_sampled() {
        let path: Vec<Joints> = (0..=20).map(|k| [k as f64 * 0.05; 9].into()).collect();
        for (velocity, acceleration) in [(1e-5, 3.0), (0.5, 1e-12), (0.5, 1e-300), (1e-300, 1e-300), (f64::MIN_POSITIVE, 3.0)] {
            let limits = Limits::alike(9, velocity, acceleration);
            let steps = time(&path, &limits, 1.0).expect_err("too long");
            assert!(steps > 10_000.0 || steps.is_nan(), "{velocity} rad/s and {acceleration} rad/s^2 took {steps} steps");
        }
    }
}
