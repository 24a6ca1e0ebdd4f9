//! A motion between two hand poses: straight if that is free, higher if that is, searched otherwise; then timed, smoothed and checked.

use super::PlanError;
use super::grasp::raised;
use super::path::{Knot, follow, tool_pose};
use super::search::Search;
use super::smooth::{Limits, smooth};
use super::timing::time;
use super::world::{CLEARANCE_M, Moved, World};
use crate::config::{MOST_STEPS, PlanSettings};
use crate::demo::Phase;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::robot::{Ik, Robot};
use rand::Rng;
use std::sync::Arc;

/// Corners are rounded this far before and behind \[m\]; the narrower one where the wider would touch something.
const CORNERS_M: [f64; 2] = [0.05, 0.015];
/// Detours that are tried before a search: the same way, but this much higher \[m\].
const HIGHER_M: [f64; 3] = [0.06, 0.12, 0.18];
/// Rounding a corner of a searched path takes away less than this \[m\].
const ROUNDING_M: f64 = 0.005;
/// Each further attempt of the smoother takes this much more time.
const STRETCH: f64 = 1.15;
/// Attempts of the smoother.
const SMOOTH_ATTEMPTS: i32 = 6;

/// A motion: fixed knots at both ends, and a free way between `from` and `to`.
pub(super) struct Leg {
    pub(super) phase: Phase,
    /// Fixed knots before `from`: the lift out of a grasp.
    pub(super) before: Vec<Knot>,
    pub(super) from: Knot,
    pub(super) to: Knot,
    /// Fixed knots behind `to`: the last straight stretch down.
    pub(super) after: Vec<Knot>,
    pub(super) moved: Moved,
    /// Distance that the path keeps before smoothing \[m\].
    pub(super) margin_m: f64,
    /// Joint angles at the first knot \[rad\].
    pub(super) start: Joints,
}

impl Leg {
    /// All knots, with this way between the ends.
    fn through(&self, way: &[Knot]) -> Vec<Knot> {
        self.before.iter().chain(way).chain(&self.after).copied().collect()
    }

    /// The straight way, `by_m` higher wherever an end is not fixed by what happens there.
    fn higher(&self, by_m: f64) -> Vec<Knot> {
        let from = if self.before.is_empty() { self.from } else { raised(&self.from, by_m) };
        let to = if self.after.is_empty() { self.to } else { raised(&self.to, by_m) };
        self.through(&[from, to])
    }
}

/// Makes motions; keeps its programs between them, which leave no trace in the results.
pub(super) struct Motions {
    pub(super) robot: Arc<Robot>,
    pub(super) settings: PlanSettings,
    pub(super) limits: Limits,
    pub(super) ik: Ik,
    pub(super) interrupt: Interrupt,
}

impl Motions {
    /// Samples of the motion at the control rate.
    pub(super) fn transit(&mut self, world: &World, leg: &Leg, rng: &mut impl Rng) -> Result<Vec<Joints>, PlanError> {
        let straight = match self.try_way(world, leg, &leg.higher(0.0)) {
            Ok(samples) => return Ok(samples),
            Err(why) => why,
        };
        // A straight lift or retreat has no other way.
        if leg.before.is_empty() && leg.after.is_empty() {
            return Err(straight);
        }
        for by_m in HIGHER_M {
            if let Ok(samples) = self.try_way(world, leg, &leg.higher(by_m)) {
                return Ok(samples);
            }
        }
        let way = self
            .search(world, leg, rng)
            .map_err(|why| PlanError::Transit(format!("{}: the straight way fails ({straight}), and {why}", leg.phase.name())))?;
        self.try_way(world, leg, &leg.through(&way))
    }

    /// Joint path, clearance, time and smoothness of one way.
    fn try_way(&mut self, world: &World, leg: &Leg, knots: &[Knot]) -> Result<Vec<Joints>, PlanError> {
        let mut last = PlanError::Transit(String::new());
        for corner_m in CORNERS_M {
            match self.try_corner(world, leg, knots, corner_m) {
                Ok(samples) => return Ok(samples),
                Err(error) => last = error,
            }
            if knots.len() < 3 {
                break;
            }
        }
        Err(last)
    }

    fn try_corner(&mut self, world: &World, leg: &Leg, knots: &[Knot], corner_m: f64) -> Result<Vec<Joints>, PlanError> {
        let transit = |why: String| PlanError::Transit(format!("{}: {why}", leg.phase.name()));
        if self.interrupt.is_raised() {
            return Err(transit("interrupted".into()));
        }
        let path = follow(&mut self.ik, knots, corner_m, &leg.start).map_err(|why| transit(why.to_string()))?;
        if world.has_obstacles() {
            clear(world, &path, &leg.moved, leg.margin_m).map_err(transit)?;
        }
        let smoothing = |why: String| PlanError::Smoothing(format!("{}: {why}", leg.phase.name()));
        let samples = smooth_path(&path, &self.limits, &self.interrupt).map_err(smoothing)?;
        clear(world, &samples, &leg.moved, CLEARANCE_M).map_err(smoothing)?;
        Ok(samples)
    }

    /// Joint angles at a hand pose, by way of `seed`.
    pub(super) fn reach(&mut self, knot: &Knot, seed: &Joints, place: &str) -> Result<Joints, PlanError> {
        let reaches = match self.robot.reach_m {
            Some([near, far]) => format!("it reaches {near} m to {far} m around the foot"),
            None => "see `hilt robot check`".into(),
        };
        self.ik.solve(&tool_pose(knot), seed).map_err(|why| {
            PlanError::Grasp(format!(
                "the level hand cannot reach {place}: {why}; {reaches}, set the spawn area \
                 (scene.spawn_x_m, scene.spawn_y_m), scene.base_xy_m and the places of the task within"
            ))
        })
    }

    fn search(&mut self, world: &World, leg: &Leg, rng: &mut impl Rng) -> Result<Vec<Knot>, String> {
        let ends = [&leg.from, &leg.to].map(|knot| self.reach(knot, &leg.start, "an end of the search"));
        let [from, to] = ends.map(|q| q.map_err(|why| why.to_string()));
        let (from, to) = (from?, to?);
        let margin_m = leg.margin_m + ROUNDING_M;
        for q in [&from, &to] {
            world.check(q, &leg.moved, margin_m).map_err(|why| format!("an end of the search is blocked: {why}"))?;
        }
        let iterations = self.settings.search_iterations;
        let shortcuts = self.settings.shortcut_iterations;
        let interrupt = &self.interrupt;
        let mut search = Search { ik: &mut self.ik, world, moved: &leg.moved, margin_m, iterations, shortcuts, interrupt };
        search.connect((leg.from, from), (leg.to, to), rng).ok_or_else(|| {
            format!("no other way was found in {iterations} iterations; raise plan.search_iterations or move the obstacles")
        })
    }
}

/// Times and smooths a joint path; slower when that is what the limits ask for.
pub(super) fn smooth_path(path: &[Joints], limits: &Limits, interrupt: &Interrupt) -> Result<Vec<Joints>, String> {
    for attempt in 0..SMOOTH_ATTEMPTS {
        let timed = time(path, limits, STRETCH.powi(attempt)).map_err(too_long)?;
        match smooth(&timed, limits, interrupt) {
            Some(samples) => return Ok(samples),
            None if interrupt.is_raised() => return Err("interrupted".into()),
            None => {}
        }
    }
    let slowest = STRETCH.powi(SMOOTH_ATTEMPTS - 1);
    Err(format!(
        "no trajectory within the limits, even {slowest:.1} times slower; raise plan.max_acceleration_rad_s2 or lower plan.speed"
    ))
}

fn too_long(steps: f64) -> String {
    let steps = if steps < 1e9 { format!("{steps:.0}") } else { format!("{steps:.0e}") };
    format!(
        "it would take {steps} control steps, and simulate.max_steps can allow no more than {MOST_STEPS}; raise plan.speed or \
         plan.max_acceleration_rad_s2"
    )
}

/// Checks a joint path at the resolution of the collision check.
fn clear(world: &World, path: &[Joints], moved: &Moved, margin_m: f64) -> Result<(), String> {
    path.windows(2).try_for_each(|w| world.check_motion(&w[0], &w[1], moved, margin_m))
}
