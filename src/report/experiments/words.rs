//! Numbers and lists as a page has them.

use crate::report::page::Cell;
use crate::report::statistics::Estimate;

/// `97.1`, a share in percent.
pub fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

/// `97.1 [96.4, 97.7]`, shares in percent.
pub fn percent_within(estimate: Estimate) -> String {
    let [low, high] = estimate.interval.map(percent);
    format!("{} [{low}, {high}]", percent(estimate.value))
}

/// `+3.2 [-1.0, +7.5]`, a difference of shares in points.
pub fn points_within(estimate: Estimate) -> String {
    let signed = |share: f64| match format!("{:+.1}", 100.0 * share) {
        zero if zero == "+0.0" || zero == "-0.0" => "0.0".into(),
        other => other,
    };
    let [low, high] = estimate.interval.map(signed);
    format!("{} [{low}, {high}]", signed(estimate.value))
}

/// `.72 [.55, .88]`, a probability.
pub fn probability_within(estimate: Estimate) -> String {
    let [low, high] = estimate.interval;
    format!("{:.2} [{low:.2}, {high:.2}]", estimate.value)
}

/// `12.5` or `0.25`, seconds in minutes; a dash for none.
pub fn minutes(seconds: Option<f64>) -> Cell {
    let in_minutes = |s: f64| if s < 60.0 { format!("{:.2}", s / 60.0) } else { format!("{:.1}", s / 60.0) };
    seconds.map_or("–".to_string(), in_minutes).into()
}

/// `a, b and c`.
pub fn listed(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Seeds as a command line takes them: `0-4,9`.
pub fn seeds(of: &[u64]) -> String {
    let mut sorted = of.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    let mut runs: Vec<[u64; 2]> = Vec::new();
    for seed in sorted {
        match runs.last_mut() {
            Some([_, last]) if *last + 1 == seed => *last = seed,
            _ => runs.push([seed, seed]),
        }
    }
    let run = |[first, last]: &[u64; 2]| if first == last { first.to_string() } else { format!("{first}-{last}") };
    runs.iter().map(run).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_people_write_them() {
        let estimate = Estimate { value: 0.971, interval: [0.9641, 0.977] };
        assert_eq!(percent_within(estimate), "97.1 [96.4, 97.7]");
        assert_eq!(points_within(Estimate { value: 0.032, interval: [-0.01, 0.075] }), "+3.2 [-1.0, +7.5]");
        assert_eq!(seeds(&[3, 0, 1, 2, 9]), "0-3,9");
        assert_eq!(listed(&["a".into(), "b".into(), "c".into()]), "a, b and c");
    }
}
