//! What the measurements share: repetitions and their table.

use std::time::Instant;

/// Seconds of `count` repetitions of `work`, fastest first: other programs only ever slow one down.
pub fn seconds(count: usize, mut work: impl FnMut()) -> Vec<f64> {
    let once = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    let mut seconds: Vec<f64> = (0..count).map(once).collect();
    seconds.sort_by(f64::total_cmp);
    seconds
}

/// The middle one of sorted numbers.
pub fn median(sorted: &[f64]) -> f64 {
    sorted[sorted.len() / 2]
}

/// The head of a table in Markdown.
pub fn head(columns: &[&str]) {
    println!("| {} |\n|{}", columns.join(" | "), "---|".repeat(columns.len()));
}
