//! A comparison in words.

use super::evaluated::Evaluated;
use super::pairing::{Change, Comparison};
use super::seeds::BySeeds;
use crate::eval::wilson_95;
use crate::report::statistics::Estimate;
use crate::report::table::{fitted_table, text_table, wrapped};
use std::collections::BTreeMap;

/// Settings that are told one by one; the others are counted.
const MOST_SETTINGS: usize = 12;
/// Episodes that are named of each kind of change.
const MOST_EPISODES: usize = 12;
/// Below this a test of this many episodes is told as an order of magnitude.
const SMALL_P: f64 = 0.001;
/// Two rates are told apart at this level.
const LEVEL: f64 = 0.05;

impl Comparison<'_> {
    /// For people.
    pub fn to_text(&self, width: Option<usize>) -> String {
        let [first, second] = self.of;
        let mut text = wrapped(&line('A', first), width) + &wrapped(&line('B', second), width) + "\n";
        let [low, high] = self.interval.map(points);
        let difference = points(self.difference);
        match &self.apart {
            Some(why) => {
                text += &wrapped(&format!("not paired: {why}"), width);
                let answer = if low.signum() == high.signum() { better(self.difference) } else { "they cannot be told apart" };
                text += &wrapped(
                    &format!(
                        "A - B: {difference:+.1} points, 95 % interval {low:+.1} to {high:+.1} (Newcombe, independent rates): {answer}"
                    ),
                    width,
                );
            }
            None => {
                text += &wrapped(
                    &format!(
                        "paired: {} episodes with the same starts, task {}, seed {}",
                        self.pairs.all(),
                        first.made.task,
                        first.made.seed
                    ),
                    width,
                );
                let p = self.mcnemar.unwrap_or(1.0);
                let answer = if p < LEVEL { better(self.difference) } else { "they cannot be told apart" };
                let p = if p < SMALL_P { format!("{p:.1e}") } else { format!("{p:.3}") };
                text += &wrapped(
                    &format!(
                        "A - B: {difference:+.1} points, 95 % interval {low:+.1} to {high:+.1} (Newcombe, pairs); McNemar's exact test p = {p}: {answer}"
                    ),
                    width,
                );
                let row = |name: &str, solved: u64, failed: u64| vec![name.to_string(), solved.to_string(), failed.to_string()];
                let pairs = &self.pairs;
                let rows = [row("A solved", pairs.both, pairs.only_first), row("A failed", pairs.only_second, pairs.neither)];
                text += &format!("\n{}", text_table(&["episodes", "B solved", "B failed"], &rows));
                text += &self.changed(width);
            }
        }
        text + &self.ends(width) + &self.differing(width)
    }

    /// Which episodes ended otherwise, the most frequent kind of change first.
    fn changed(&self, width: Option<usize>) -> String {
        let mut kinds: BTreeMap<(&str, &str), Vec<i64>> = BTreeMap::new();
        for Change { episode, first, second } in &self.changes {
            kinds.entry((first, second)).or_default().push(*episode);
        }
        let mut kinds: Vec<_> = kinds.into_iter().collect();
        kinds.sort_by_key(|(kind, episodes)| (std::cmp::Reverse(episodes.len()), *kind));
        if kinds.is_empty() {
            return "\nevery episode ended the same way\n".into();
        }
        let mut text = "\nepisodes that ended otherwise, A -> B\n".to_string();
        for ((first, second), episodes) in kinds {
            let more = episodes.len().saturating_sub(MOST_EPISODES);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let named: Vec<String> = episodes.iter().take(MOST_EPISODES).map(i64::to_string).collect();
            text += &wrapped(&format!("  {} {first} -> {second}: {}{more}", episodes.len(), named.join(" ")), width);
        }
        text
    }

    /// Failures, conditions and lengths.
    fn ends(&self, width: Option<usize>) -> String {
        let row = |name: String, [a, b]: [u64; 2]| {
            vec![name, a.to_string(), b.to_string(), format!("{:+}", a.cast_signed() - b.cast_signed())]
        };
        let mut rows: Vec<Vec<String>> = self.failures.iter().map(|(class, n)| row(format!("failed: {class}"), *n)).collect();
        rows.extend(self.conditions.iter().map(|(name, n)| row(format!("at the end: {name}"), *n)));
        let of = if self.apart.is_none() { "steps where both solved, median" } else { "steps where solved, median" };
        rows.push(row(of.into(), self.steps.map(|steps| steps.p50)));
        format!("\n{}", fitted_table(&["", "A", "B", "A - B"], &rows, width))
    }

    fn differing(&self, width: Option<usize>) -> String {
        if self.settings.is_empty() {
            return String::new();
        }
        let mut text = "\nsettings that differ\n".to_string();
        for difference in self.settings.iter().take(MOST_SETTINGS) {
            text += &wrapped(&format!("  {}: {} -> {}", difference.key, difference.theirs, difference.ours), width);
        }
        let more = self.settings.len().saturating_sub(MOST_SETTINGS);
        if more > 0 {
            text += &format!("  and {more} more (--json has all)\n");
        }
        text
    }
}

fn better(difference: f64) -> &'static str {
    if difference > 0.0 { "A is better" } else { "B is better" }
}

fn points(share: f64) -> f64 {
    100.0 * share
}

fn line(letter: char, evaluated: &Evaluated) -> String {
    let (solved, all) = evaluated.counts();
    let [low, high] = wilson_95(solved, all).map(points);
    let share = points(solved as f64 / all.max(1) as f64);
    format!("{letter}: {}: {solved} of {all} ({share:.1} %, {low:.1} to {high:.1} %)", evaluated.name)
}

impl BySeeds {
    /// For people.
    pub fn to_text(&self, names: [&str; 2], width: Option<usize>) -> String {
        let mut text = String::new();
        for ((letter, name), mean) in ['A', 'B'].into_iter().zip(names).zip(self.means()) {
            text += &wrapped(&format!("{letter}: {name}: mean {}", percent(mean)), width);
        }
        let comparison = &self.comparison;
        let difference = comparison.difference;
        let [low, high] = difference.interval.map(points);
        text += "\n";
        text += &wrapped(
            &format!(
                "paired by seed, {} seeds: A - B {:+.1} points, 95 % interval {low:+.1} to {high:+.1} (bootstrap over seeds); probability that A beats B \
                 {}: {}",
                comparison.pairs,
                points(difference.value),
                percent(comparison.improvement),
                self.verdict()
            ),
            width,
        );
        let mut rows = Vec::new();
        for (at, task) in self.tasks.iter().enumerate() {
            for score in &self.scores[0][at] {
                let Some(other) = self.scores[1][at].iter().find(|other| other.seed == score.seed) else { continue };
                let cell = |share: f64| format!("{:.1} %", points(share));
                let apart = format!("{:+.1}", points(score.value - other.value));
                rows.push(vec![task.clone(), score.seed.to_string(), cell(score.value), cell(other.value), apart]);
            }
        }
        text + "\n" + &fitted_table(&["task", "seed", "A", "B", "A - B"], &rows, width)
    }
}

fn percent(estimate: Estimate) -> String {
    let [low, high] = estimate.interval.map(points);
    format!("{:.1} % ({low:.1} to {high:.1})", points(estimate.value))
}
