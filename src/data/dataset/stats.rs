//! The statistics LeRobot keeps of every feature: over all frames, and over each episode.

/// Names of the statistics, `count` aside.
pub(super) const NAMES: [&str; 9] = ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"];
/// Levels of the last five.
pub(super) const LEVELS: [f64; 5] = [0.01, 0.10, 0.50, 0.90, 0.99];

/// Statistics of one feature.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stats {
    /// One row for each of [`NAMES`], one number for each entry of the feature.
    pub(super) rows: Vec<Vec<f64>>,
    /// Frames.
    pub(super) count: usize,
}

/// Of row-major `values` with `width` numbers a row. The standard deviation has ddof 0; quantiles interpolate between neighbours.
pub(super) fn stats(values: &[f64], width: usize) -> Stats {
    let count = values.len() / width;
    let mut rows = vec![Vec::with_capacity(width); NAMES.len()];
    for entry in 0..width {
        let mut column: Vec<f64> = values.iter().skip(entry).step_by(width).copied().collect();
        let mean = column.iter().sum::<f64>() / count as f64;
        let variance = column.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64;
        column.sort_unstable_by(f64::total_cmp);
        let found = of_entry(count, mean, variance, |place| column[place]);
        rows.iter_mut().zip(found).for_each(|(row, value)| row.push(value));
    }
    Stats { rows, count }
}

/// The statistics of an entry, as in [`NAMES`]; `sorted` gives the value at a place of its sorted column of `count` values.
pub(super) fn of_entry(count: usize, mean: f64, variance: f64, sorted: impl Fn(usize) -> f64) -> [f64; NAMES.len()] {
    let quantile = |level: f64| {
        let (below, above, share) = neighbours(level, count);
        sorted(below) + (sorted(above) - sorted(below)) * share
    };
    let [q01, q10, q50, q90, q99] = LEVELS.map(quantile);
    [sorted(0), sorted(count - 1), mean, variance.sqrt(), q01, q10, q50, q90, q99]
}

/// The places in a sorted column of `count` values between which the quantile of a level lies, and how far.
pub(super) fn neighbours(level: f64, count: usize) -> (usize, usize, f64) {
    let place = level * (count - 1) as f64;
    (place.floor() as usize, place.ceil() as usize, place.fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_a_small_table() {
        // Columns 0..=100 and a constant.
        let values: Vec<f64> = (0..=100).rev().flat_map(|i| [f64::from(i), 2.5]).collect();
        let found = stats(&values, 2);
        assert_eq!(found.count, 101);
        let first: Vec<f64> = found.rows.iter().map(|r| r[0]).collect();
        let expected = [0.0, 100.0, 50.0, 850f64.sqrt(), 1.0, 10.0, 50.0, 90.0, 99.0];
        assert!(first.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{first:?}");
        assert_eq!(found.rows.iter().map(|r| r[1]).collect::<Vec<_>>(), [2.5, 2.5, 2.5, 0.0, 2.5, 2.5, 2.5, 2.5, 2.5]);
    }
}
