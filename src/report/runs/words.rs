//! A run in words: the answer, then how it stands, then where it comes from.

use super::run::{Judged, Run};
use super::standing::{Condition, Standing, file_name};
use crate::data::Provenance;
use crate::report::table::{fitted_table, wrapped};
use std::fmt::Write;

/// Characters of a content's hash that tell one from another.
const SHORT_HASH: usize = 12;
/// Bytes of the units that sizes are told in.
const UNITS: [(u64, &str); 3] = [(1_000_000_000, "GB"), (1_000_000, "MB"), (1_000, "kB")];

impl Run {
    /// For people, no line longer than `width` where that can be helped.
    pub fn to_text(&self, width: Option<usize>) -> String {
        let mut text = String::new();
        if self.judged.is_empty() {
            text += &wrapped(&format!("{}: nothing is evaluated yet", self.task().unwrap_or("no task")), width);
        }
        for judged in &self.judged {
            text += &wrapped(&judged.to_line(), width);
        }
        text += "\n";
        let rows: Vec<Vec<String>> = self.stages.iter().map(row).collect();
        text += &fitted_table(&["stage", "stands", "wall time", "size", "artefact"], &rows, width);
        let not_whole = self.stages.iter().filter_map(|s| s.why.as_ref().map(|why| format!("{}: {why}", s.name)));
        let not_whole: Vec<String> = not_whole.collect();
        if !not_whole.is_empty() {
            text += "\n";
            not_whole.iter().for_each(|line| text += &wrapped(line, width));
        }
        text + "\nprovenance\n" + &self.provenance(width)
    }

    /// What made the artefacts, once where all say the same; then the hashes of their content.
    fn provenance(&self, width: Option<usize>) -> String {
        let origins = || self.stages.iter().filter_map(|standing| Some((standing, standing.origin.as_ref()?)));
        let said = |made: &Provenance| {
            let robot = made.settings["robot"]["name"].as_str().map(|robot| format!(", robot {robot}")).unwrap_or_default();
            format!("hilt {}, task {}{robot}, seed {}", made.hilt_version, made.task, made.seed)
        };
        let mut all: Vec<(String, Vec<&str>)> = Vec::new();
        for (standing, (made, _)) in origins() {
            let said = said(made);
            match all.iter_mut().find(|(known, _)| *known == said) {
                Some((_, names)) => names.push(&standing.name),
                None => all.push((said, vec![&standing.name])),
            }
        }
        let mut text = String::new();
        for (said, names) in &all {
            let of = if all.len() > 1 { format!(": {}", names.join(", ")) } else { String::new() };
            text += &wrapped(&format!("  {said}{of}"), width);
        }
        let contents = origins().map(|(standing, (_, content))| {
            let content = content.to_string();
            format!("{} {}", standing.name, &content[..SHORT_HASH])
        });
        text += &wrapped(&format!("  content: {}", contents.collect::<Vec<_>>().join(", ")), width);
        text + &wrapped("  hilt inspect of an artefact has its settings, --json all of them", width)
    }
}

impl Judged {
    /// Success with its interval, and why the others failed.
    fn to_line(&self) -> String {
        let Judged { method, summary, .. } = self;
        let [low, high] = summary.wilson_95.map(|v| 100.0 * v);
        let mut classes: Vec<(&String, &u64)> = summary.failures.iter().filter(|(_, n)| **n > 0).collect();
        classes.sort_by_key(|(name, n)| (std::cmp::Reverse(**n), *name));
        let classes: Vec<String> = classes.iter().map(|(name, n)| format!("{n} {name}")).collect();
        let failed = if classes.is_empty() { String::new() } else { format!("; failed: {}", classes.join(", ")) };
        let share = 100.0 * summary.success_rate;
        format!(
            "{} by {method}: success {} of {} ({share:.1} %, 95 % interval {low:.1} to {high:.1} %), steps p50 {} p95 {}{failed}",
            summary.task, summary.successes, summary.episodes, summary.episode_steps.p50, summary.episode_steps.p95
        )
    }
}

fn row(standing: &Standing) -> Vec<String> {
    let there = !matches!(standing.condition, Condition::Missing | Condition::Unfinished);
    let wall = standing.wall_s.map_or("-".into(), |s| format!("{s:.1} s"));
    let size = if there { size(standing.bytes) } else { "-".into() };
    vec![standing.name.clone(), standing.condition.name().into(), wall, size, file_name(&standing.path)]
}

/// `164 kB`.
pub(super) fn size(bytes: u64) -> String {
    let mut text = String::new();
    let unit = UNITS.iter().find(|(unit, _)| bytes >= *unit);
    let _ = match unit {
        Some((unit, name)) => write!(text, "{:.1} {name}", bytes as f64 / *unit as f64),
        None => write!(text, "{bytes} B"),
    };
    text
}
