//! Model selection: rollouts on episodes of their own choose among the policies along the way.

use super::metrics::EpochMetrics;
use crate::config::TrainSettings;
use serde::{Deserialize, Serialize};

/// A policy that was rolled out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Candidate {
    /// Name of the stage.
    pub stage: String,
    /// Epoch of the stage after which it stood, from 1.
    pub epoch: u64,
    /// Episodes that it solved.
    pub successes: u64,
}

/// All candidates, and which was chosen.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Selection {
    /// In the order of training.
    pub candidates: Vec<Candidate>,
    /// Position of the chosen one.
    pub chosen: usize,
}

impl Selection {
    /// The chosen candidate, if there is any.
    pub fn best(&self) -> Option<&Candidate> {
        self.candidates.get(self.chosen)
    }

    /// Takes in a candidate; whether it is the best so far. Of equals the later one is.
    pub fn offer(&mut self, row: &EpochMetrics, successes: u64) -> bool {
        let better = self.best().is_none_or(|best| successes >= best.successes);
        if better {
            self.chosen = self.candidates.len();
        }
        self.candidates.push(Candidate { stage: row.stage.clone(), epoch: row.epoch, successes });
        better
    }

    /// Whether the policy after this epoch is a candidate that was not rolled out yet.
    pub fn wants(&self, row: &EpochMetrics, settings: &TrainSettings) -> bool {
        let known = self.candidates.last().is_some_and(|c| c.stage == row.stage && c.epoch == row.epoch);
        settings.select_episodes > 0 && !known && is_candidate(row, settings)
    }
}

fn is_candidate(row: &EpochMetrics, settings: &TrainSettings) -> bool {
    let count = settings.select_candidates;
    let passed = |epoch: u64| epoch * count / row.epochs;
    passed(row.epoch) > passed(row.epoch - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HIL: &str = "hil";

    #[test]
    fn of_equals_the_later_candidate_wins() {
        let mut selection = Selection::default();
        let better: Vec<bool> =
            [3, 5, 4, 5, 0].iter().zip(1..).map(|(s, epoch)| selection.offer(&EpochMetrics::new(HIL, epoch, 5), *s)).collect();
        assert_eq!((better, selection.chosen), (vec![true, true, false, true, false], 3));
    }

    #[test]
    fn candidates_are_evenly_spaced_and_the_end_is_one() {
        let settings = TrainSettings { select_candidates: 3, select_episodes: 1, ..Default::default() };
        let epochs = |epochs, settings: &TrainSettings| -> Vec<u64> {
            let wanted = |e: &u64| Selection::default().wants(&EpochMetrics::new(HIL, *e, epochs), settings);
            (1..=epochs).filter(wanted).collect()
        };
        assert_eq!(epochs(25, &settings), [9, 17, 25]);
        assert_eq!(epochs(300, &settings), [100, 200, 300]);
        assert_eq!(epochs(2, &settings), [1, 2]);
        assert_eq!(epochs(300, &TrainSettings { select_candidates: 1, ..settings.clone() }), [300]);
        assert_eq!(epochs(25, &TrainSettings { select_episodes: 0, ..settings }), [] as [u64; 0]);
    }

    #[test]
    fn a_candidate_is_rolled_out_once() {
        let settings = TrainSettings { select_episodes: 1, ..Default::default() };
        let (mut selection, row) = (Selection::default(), EpochMetrics::new(HIL, 3, 3));
        assert!(selection.wants(&row, &settings));
        selection.offer(&row, 1);
        assert!(!selection.wants(&row, &settings));
    }
}
