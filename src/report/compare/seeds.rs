//! Two groups of evaluations by seed: a seed sets demos, training and evaluation, so the same seed of both is a pair.

use super::evaluated::Evaluated;
use crate::report::statistics::{Comparison, Estimate, Score, Strata, Verdict, mean};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// How two groups compare.
#[derive(Clone, Debug)]
pub struct BySeeds {
    /// Tasks that both have.
    pub tasks: Vec<String>,
    /// The scores of each group: a list a task.
    pub scores: [Strata; 2],
    /// Over the seeds that both have.
    pub comparison: Comparison,
}

/// Pairs seeds.
///
/// # Errors
/// Says which evaluations are of the same task and seed, or that there is nothing to pair.
pub fn by_seeds(first: &[Evaluated], second: &[Evaluated]) -> Result<BySeeds, String> {
    let tasks = |of: &[Evaluated]| of.iter().map(|evaluated| evaluated.made.task.clone()).collect::<BTreeSet<_>>();
    let tasks: Vec<String> = tasks(first).intersection(&tasks(second)).cloned().collect();
    let scores = [strata(first, &tasks)?, strata(second, &tasks)?];
    let comparison = Comparison::of(&scores[0], &scores[1]);
    let comparison =
        comparison.ok_or("they have no seed of the same task in common, so there is nothing to pair; name single evaluations")?;
    Ok(BySeeds { tasks, scores, comparison })
}

fn strata(of: &[Evaluated], tasks: &[String]) -> Result<Strata, String> {
    tasks.iter().map(|task| scores(of, task)).collect()
}

fn scores(of: &[Evaluated], task: &str) -> Result<Vec<Score>, String> {
    let mut scores: Vec<(Score, &Evaluated)> = Vec::new();
    for evaluated in of.iter().filter(|evaluated| evaluated.made.task == task) {
        let ((solved, all), seed) = (evaluated.counts(), evaluated.made.seed);
        if let Some((_, other)) = scores.iter().find(|(score, _)| score.seed == seed) {
            let (a, b) = (&other.name, &evaluated.name);
            return Err(format!(
                "{a} and {b} are both of {task}, seed {seed}; name one method (DIR:hil) or a directory with one evaluation a seed"
            ));
        }
        scores.push((Score { seed, value: solved as f64 / all.max(1) as f64 }, evaluated));
    }
    scores.sort_by_key(|(score, _)| score.seed);
    Ok(scores.into_iter().map(|(score, _)| score).collect())
}

impl BySeeds {
    /// What the intervals say.
    pub fn verdict(&self) -> &'static str {
        match self.comparison.verdict() {
            Verdict::Better => "the first is better",
            Verdict::Worse => "the second is better",
            Verdict::CannotTell => "they cannot be told apart",
            Verdict::TooFew => "fewer than three seeds tell nothing apart",
        }
    }

    /// Mean over the seeds of each group, whether the other has them or not.
    pub fn means(&self) -> [Estimate; 2] {
        [mean(&self.scores[0]), mean(&self.scores[1])]
    }

    /// For machines.
    pub fn to_json(&self) -> Value {
        let estimate = |e: Estimate| json!({ "value": e.value, "interval_95": e.interval });
        let scores = |strata: &Strata| {
            let of = |(task, scores): (&String, &Vec<Score>)| {
                let scores: Vec<Value> =
                    scores.iter().map(|score| json!({ "seed": score.seed, "success_rate": score.value })).collect();
                (task.clone(), Value::Array(scores))
            };
            Value::Object(self.tasks.iter().zip(strata).map(of).collect())
        };
        let [first, second] = self.means();
        json!({
            "kind": "comparison by seeds",
            "first": { "mean": estimate(first), "scores": scores(&self.scores[0]) },
            "second": { "mean": estimate(second), "scores": scores(&self.scores[1]) },
            "pairs": self.comparison.pairs,
            "difference": estimate(self.comparison.difference),
            "probability_of_improvement": estimate(self.comparison.improvement),
            "verdict": self.verdict(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::pairing::tests::evaluated;
    use super::*;

    #[test]
    fn seeds_that_both_have_are_pairs_and_two_of_one_seed_are_refused() {
        let group = |ends: [&[&str]; 4]| (0..).zip(ends).map(|(seed, ends)| evaluated("a", seed, 0, ends)).collect::<Vec<_>>();
        let (good, bad): (&[&str], &[&str]) = (&["", "", "", "x"], &["x", "x", "", "x"]);
        let (a, b) = (group([good; 4]), group([bad; 4]));
        let found = by_seeds(&a, &b).expect("pairs");
        assert_eq!((found.comparison.pairs, found.comparison.difference.value, found.verdict()), (4, 0.5, "the first is better"));
        assert!(by_seeds(&a[..2], &b).expect("pairs").verdict().contains("fewer than three seeds"));
        let twice = [&a[..], &b[..1]].concat();
        assert!(by_seeds(&twice, &b).expect_err("refused").contains("are both of lift, seed 0"));
        assert!(by_seeds(&a[..1], &b[1..]).expect_err("refused").contains("no seed of the same task in common"));
    }
}
