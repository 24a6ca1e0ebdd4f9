//! The statistics LeRobot keeps of every feature: over all frames, and over each episode.

/// Names of the statistics, `count` aside.
pub(super) const NAMES: [&str; 9] = ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"];
/// Levels of the last five.
const LEVELS: [f64; 5] = [0.01, 0.10, 0.50, 0.90, 0.99];

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
        column.sort_by(f64::total_cmp);
        let head = [column[0], column[count - 1], mean, variance.sqrt()];
        for (row, value) in rows.iter_mut().zip(head.into_iter().chain(LEVELS.map(|level| quantile(&column, level)))) {
            row.push(value);
        }
    }
    Stats { rows, count }
}

fn quantile(sorted: &[f64], level: f64) -> f64 {
    let place = level * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    below + (above - below) * place.fract()
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
