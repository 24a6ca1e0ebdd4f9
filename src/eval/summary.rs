//! What an evaluation comes to, in the fields that scripts read.

use super::{Trial, wilson_95};
use crate::task::{FailureClass, Task};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Median and 95th percentile (nearest rank).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50: u64,
    /// 95th percentile.
    pub p95: u64,
}

impl Percentiles {
    /// Of any values; zeros when there are none.
    pub fn of(mut values: Vec<u64>) -> Self {
        values.sort_unstable();
        let rank = |percent: usize| {
            let nearest = (values.len() * percent).div_ceil(100).max(1) - 1;
            values.get(nearest).copied().unwrap_or(0)
        };
        Percentiles { p50: rank(50), p95: rank(95) }
    }
}

/// The result of an evaluation: `evaluation.json` and `hilt evaluate --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// The task's name.
    pub task: String,
    /// Episodes run.
    pub episodes: u64,
    /// Episodes solved.
    pub successes: u64,
    /// successes / episodes.
    pub success_rate: f64,
    /// Wilson 95 % interval of the success rate.
    pub wilson_95: [f64; 2],
    /// Failed episodes per class; every class is there.
    pub failures: BTreeMap<String, u64>,
    /// Episodes at whose end each condition of the task held.
    pub conditions: BTreeMap<String, u64>,
    /// Lengths of all episodes, in control steps of 50 ms.
    pub episode_steps: Percentiles,
}

impl Summary {
    /// Counts up the trials of one evaluation of `task`.
    pub fn of(task: &Task, trials: &[Trial]) -> Self {
        let episodes = trials.len() as u64;
        let count = |keep: &dyn Fn(&Trial) -> bool| trials.iter().filter(|t| keep(t)).count() as u64;
        let successes = count(&|t| t.success);
        let failures = FailureClass::ALL.map(|class| (class.name().to_string(), count(&|t| t.failure == Some(class))));
        let conditions = task.condition_names().into_iter().enumerate();
        Summary {
            task: task.name.clone(),
            episodes,
            successes,
            success_rate: if episodes == 0 { 0.0 } else { successes as f64 / episodes as f64 },
            wilson_95: wilson_95(successes, episodes),
            failures: failures.into(),
            conditions: conditions.map(|(i, name)| (name, count(&|t| t.conditions[i]))).collect(),
            episode_steps: Percentiles::of(trials.iter().map(|t| t.steps).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::paper_robot;
    use crate::scene::{Placed, Scene};
    use crate::state::Pose;
    use crate::task::built_in::pick_up;

    fn trial(index: u64, failure: Option<FailureClass>, steps: u64) -> Trial {
        let block = Placed { pose: Pose::from_yaw([0.4, 0.0, 0.025], 0.0), friction: 1.0, mass_kg: 0.1 };
        let scene = Scene {
            robot: paper_robot(),
            task: pick_up(),
            objects: vec![block],
            goals: vec![],
            obstacles: vec![],
            finger_friction: 1.0,
        };
        let conditions = vec![true, true, failure.is_none(), failure.is_none(), failure.is_none()];
        Trial { index, scene, success: failure.is_none(), failure, steps, reward: 0.0, conditions, hit_obstacle: false }
    }

    #[test]
    fn counts_add_up_and_json_has_the_promised_fields() {
        let trials: Vec<Trial> =
            (0..20).map(|i| trial(i, (i < 3).then_some(FailureClass::Dropped), if i < 3 { 400 } else { 80 + i })).collect();
        let summary = Summary::of(&pick_up(), &trials);
        assert_eq!((summary.episodes, summary.successes, summary.success_rate), (20, 17, 0.85));
        assert_eq!(summary.failures["dropped"], 3);
        assert_eq!(summary.failures.values().sum::<u64>() + summary.successes, summary.episodes);
        assert_eq!(summary.conditions["at_height"], 17);
        let json = serde_json::to_value(&summary).expect("a summary has a JSON form");
        for field in ["task", "episodes", "successes", "success_rate", "wilson_95", "failures", "conditions", "episode_steps"] {
            assert!(json.get(field).is_some(), "{field} is missing");
        }
        assert_eq!(json["task"], "pick-up");
        assert_eq!(json["episode_steps"]["p95"], 400);
    }

    #[test]
    fn percentiles_are_nearest_ranks() {
        assert_eq!(Percentiles::of((1..=100).collect()), Percentiles { p50: 50, p95: 95 });
        assert_eq!(Percentiles::of(vec![7]), Percentiles { p50: 7, p95: 7 });
        assert_eq!(Percentiles::of(vec![]), Percentiles { p50: 0, p95: 0 });
    }
}
