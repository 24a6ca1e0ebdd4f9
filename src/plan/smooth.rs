//! The smoother: one quadratic program per joint over the whole trajectory of a piece, from rest to rest.
//!
//! With x the deviation from the timed path r and D1, D2, D3 the first to third differences:
//! minimise w |D3 (r + x)|^2 + |x|^2 subject to |D1 (r + x)| <= v dt, |D2 (r + x)| <= a dt^2, low <= r + x <= high, x = 0 at the ends
//! and beyond them (at rest before and after).

use crate::config::PlanSettings;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::robot::Robot;
use crate::state::CONTROL_DT_S;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// Bends quicker than this are rounded off \[s\]: the weight of squared jerk is (this / dt)^6.
const SMOOTHING_TIME_S: f64 = 0.10;
/// Time in which the fingers reach their speed \[s\], two control steps: they are light.
const FINGER_START_S: f64 = 2.0 * CONTROL_DT_S;
/// Share of the limits that the program may use, so that its solution holds them in spite of rounding.
const TIGHT: f64 = 1.0 - 1e-5;
/// A joint that moves less than this over a piece keeps its place \[rad\].
const STILL_RAD: f64 = 1e-7;
/// Duality gap of a solution: the path's shape matters to a few micrometres, the limits are held by the feasibility tolerance.
const GAP: f64 = 1e-6;
/// Residual at which the solver stops refining its linear systems: the default refines to rounding, at a third of the time.
const REFINEMENT: f64 = 1e-9;
/// Joints that stay this far inside their position limits need no rows for them \[rad\]; smoothing moves a joint by far less.
const NEAR_LIMIT_RAD: f64 = 0.1;
/// Third difference.
const JERK: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];

/// What a plan may use of each joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Lowest and highest \[rad, m\].
    pub position: Vec<[f64; 2]>,
    /// \[rad/s, m/s\].
    pub velocity: Joints,
    /// \[rad/s^2, m/s^2\].
    pub acceleration: Joints,
    /// What counts as a radian of each joint \[1, m/rad\]: the program's tolerances are meant for radians.
    pub unit: Joints,
}

impl Limits {
    /// From the settings: a fraction of the arm's velocity limits and one acceleration; the fingers have their own.
    pub fn new(robot: &Robot, settings: &PlanSettings) -> Self {
        let each = |arm: &dyn Fn(usize) -> f64, finger: f64| {
            Joints::from_fn(robot.joints.len(), |j| if j < robot.arm { arm(j) } else { finger })
        };
        Limits {
            position: robot.joints.iter().map(|joint| joint.limits).collect(),
            velocity: each(&|j| settings.speed * robot.joints[j].velocity, robot.finger_speed),
            acceleration: each(&|_| settings.max_acceleration_rad_s2, robot.finger_speed / FINGER_START_S),
            unit: robot.joints.iter().map(|joint| joint.per_radian()).collect(),
        }
    }

    #[cfg(test)]
    pub(super) fn alike(joints: usize, velocity: f64, acceleration: f64) -> Self {
        let all = |value: f64| Joints::from_fn(joints, |_| value);
        let position = vec![[0.0, 1.51]; joints];
        Limits { position, velocity: all(velocity), acceleration: all(acceleration), unit: all(1.0) }
    }
}

/// Smooths samples that are one control step apart; `None` when no trajectory of this duration holds the limits, or on an interrupt.
pub(super) fn smooth(samples: &[Joints], limits: &Limits, interrupt: &Interrupt) -> Option<Vec<Joints>> {
    let mut smoothed = samples.to_vec();
    let last = samples.len() - 1;
    if last < 2 {
        return Some(smoothed);
    }
    let path = |j: usize| samples.iter().map(|q| q[j] / limits.unit[j]).collect::<Vec<f64>>();
    let still = |path: &[f64]| path.iter().all(|q| (q - path[0]).abs() < STILL_RAD);
    let near_limit = (0..samples[0].len()).any(|j| {
        let [low, high] = limits.position[j].map(|limit| limit / limits.unit[j]);
        let path = path(j);
        !still(&path) && path.iter().any(|q| *q < low + NEAR_LIMIT_RAD || *q > high - NEAR_LIMIT_RAD)
    });
    let mut program = None;
    for j in 0..samples[0].len() {
        interrupt.check().ok()?;
        let path = path(j);
        if still(&path) {
            continue;
        }
        let (slope, bounds) = (slope(&path), bounds(&path, j, limits, near_limit));
        let solver = match &mut program {
            None => program.insert(build(last - 1, &slope, &bounds, near_limit)),
            Some(solver) => {
                let untouched: [f64; 0] = [];
                solver
                    .update_data(&untouched, &slope, &untouched, &bounds)
                    .expect("every joint's program has the same structure");
                solver
            }
        };
        solver.solve();
        if !matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved) {
            return None;
        }
        solver.solution.x.iter().zip(&mut smoothed[1..last]).for_each(|(x, q)| q[j] += x * limits.unit[j]);
    }
    Some(smoothed)
}

/// w: weight of squared third differences against squared deviation.
fn jerk_weight() -> f64 {
    (SMOOTHING_TIME_S / CONTROL_DT_S).powi(6)
}

/// The path's value at sample k, at rest before and after.
fn at(path: &[f64], k: isize) -> f64 {
    path[k.clamp(0, path.len() as isize - 1) as usize]
}

/// Gradient of the cost at x = 0: w D3' D3 r at the free samples.
fn slope(path: &[f64]) -> Vec<f64> {
    let last = path.len() - 1;
    let mut slope = vec![0.0; last - 1];
    for row in -2..last as isize {
        let jerk: f64 = (0..4).map(|c| JERK[c as usize] * at(path, row + c)).sum();
        for c in 0..4 {
            let k = row + c;
            if (1..last as isize).contains(&k) {
                slope[k as usize - 1] += jerk_weight() * JERK[c as usize] * jerk;
            }
        }
    }
    slope
}

/// Right-hand sides, in the order of the rows of [`build`]: room above, then room below, for velocity, acceleration and (if asked) position.
fn bounds(path: &[f64], j: usize, limits: &Limits, near_limit: bool) -> Vec<f64> {
    let last = path.len() as isize - 1;
    let unit = limits.unit[j];
    let step = TIGHT * (limits.velocity[j] / unit) * CONTROL_DT_S;
    let bend = TIGHT * (limits.acceleration[j] / unit) * CONTROL_DT_S.powi(2);
    let [low, high] = limits.position[j].map(|limit| limit / unit);
    let mut room: Vec<[f64; 2]> = Vec::with_capacity(3 * path.len());
    // The sample at rest has velocity 0 (it ends the phase before), so the first moving one starts from there.
    let step_at = |k: isize| if k == 1 { step.min(bend) } else { step };
    room.extend((0..last).map(|k| (step_at(k), at(path, k + 1) - at(path, k))).map(|(step, d)| [step - d, step + d]));
    room.extend((0..=last).map(|k| at(path, k + 1) - 2.0 * at(path, k) + at(path, k - 1)).map(|d| [bend - d, bend + d]));
    if near_limit {
        room.extend((1..last).map(|k| at(path, k)).map(|q| [high - q, q - low]));
    }
    room.iter().map(|r| r[0]).chain(room.iter().map(|r| r[1])).collect()
}

/// The program for `free` samples between two pinned ones.
fn build(free: usize, slope: &[f64], bounds: &[f64], near_limit: bool) -> DefaultSolver<f64> {
    let mut columns: Vec<Vec<(usize, f64)>> = vec![Vec::new(); free];
    let mut rows = 0;
    let mut row = |first: isize, coefficients: &[f64]| {
        for (c, value) in coefficients.iter().enumerate() {
            let k = first + c as isize - 1;
            if (0..free as isize).contains(&k) {
                columns[k as usize].push((rows, *value));
            }
        }
        rows += 1;
    };
    let last = free as isize + 1;
    (0..last).for_each(|k| row(k, &[-1.0, 1.0]));
    (0..=last).for_each(|k| row(k - 1, &[1.0, -2.0, 1.0]));
    if near_limit {
        (1..last).for_each(|k| row(k, &[1.0]));
    }
    let mirrored = columns.iter().map(|column| {
        let below = column.iter().map(|(r, v)| (r + rows, -v));
        column.iter().copied().chain(below).collect::<Vec<_>>()
    });
    let constraints = sparse(2 * rows, mirrored.collect());
    let settings = DefaultSettings {
        verbose: false,
        max_threads: 1,
        presolve_enable: false,
        tol_gap_abs: GAP,
        tol_gap_rel: GAP,
        iterative_refinement_reltol: REFINEMENT,
        iterative_refinement_abstol: REFINEMENT,
        ..DefaultSettings::default()
    };
    DefaultSolver::new(&cost(free), slope, &constraints, bounds, &[SupportedConeT::NonnegativeConeT(2 * rows)], settings)
        .expect("a program of matching sizes")
}

/// Upper triangle of w D3' D3 + I: four diagonals.
fn cost(free: usize) -> CscMatrix<f64> {
    let columns = (0..free)
        .map(|k| {
            let near = k.saturating_sub(JERK.len() - 1);
            (near..=k)
                .map(|i| {
                    let gap = k - i;
                    let overlap: f64 = (gap..JERK.len()).map(|c| JERK[c] * JERK[c - gap]).sum();
                    (i, jerk_weight() * overlap + if gap == 0 { 1.0 } else { 0.0 })
                })
                .collect()
        })
        .collect();
    sparse(free, columns)
}

fn sparse(rows: usize, columns: Vec<Vec<(usize, f64)>>) -> CscMatrix<f64> {
    let mut starts = vec![0];
    starts.extend(columns.iter().scan(0, |sum, c| {
        *sum += c.len();
        Some(*sum)
    }));
    let (indices, values) = columns.iter().flatten().copied().unzip();
    CscMatrix::new(rows, columns.len(), starts, indices, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits() -> Limits {
        Limits::alike(9, 0.5, 2.0)
    }

    #[test]
    fn rounds_a_kink_off_within_the_limits_and_keeps_the_ends() {
        // Velocity jumps from 0 to 0.4 rad/s and back: far beyond the acceleration limit.
        let samples: Vec<Joints> = (0..60).map(|k: i32| [0.85 + 0.02 * f64::from((k - 15).clamp(0, 30)); 9].into()).collect();
        let smoothed = smooth(&samples, &limits(), &Interrupt::default()).expect("there is time enough");
        assert_eq!((smoothed[0], smoothed[59]), (samples[0], samples[59]));
        for w in smoothed.windows(3) {
            assert!((w[1][0] - w[0][0]).abs() / CONTROL_DT_S <= 0.5);
            assert!((0.82..1.51).contains(&w[1][0]));
            assert!((w[2][0] - 2.0 * w[1][0] + w[0][0]).abs() / CONTROL_DT_S.powi(2) <= 2.0);
        }
        let off = smoothed.iter().zip(&samples).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f64::max);
        assert!((0.001..0.03).contains(&off), "{off} rad off the path");
    }

    #[test]
    fn says_when_the_time_is_too_short() {
        let samples: Vec<Joints> = (0..10).map(|k| [0.1 + 0.1 * f64::from(k); 9].into()).collect();
        assert!(smooth(&samples, &limits(), &Interrupt::default()).is_none());
    }
}
