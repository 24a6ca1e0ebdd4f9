//! The Wilson score interval: honest for rates near 1, where the normal interval leaves \[0, 1\].

/// The 0.975 quantile of the standard normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// The Wilson 95 % interval of a rate, `successes` of `trials`; \[0, 1\] when nothing was tried.
/// E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22 (1927).
pub fn wilson_95(successes: u64, trials: u64) -> [f64; 2] {
    if trials == 0 {
        return [0.0, 1.0];
    }
    let n = trials as f64;
    let p = successes as f64 / n;
    let z2 = Z_95 * Z_95;
    let center = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z_95 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    // At 0 and n successes the exact end is 0 or 1; rounding would leave a trace.
    let low = if successes == 0 { 0.0 } else { (center - half).max(0.0) };
    let high = if successes == trials { 1.0 } else { (center + half).min(1.0) };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::wilson_95;

    fn close(got: [f64; 2], want: [f64; 2]) {
        assert!((got[0] - want[0]).abs() < 5e-5 && (got[1] - want[1]).abs() < 5e-5, "{got:?} against {want:?}");
    }

    #[test]
    fn known_intervals() {
        // Newcombe, "Two-sided confidence intervals for the single proportion", Stat. Med. 17 (1998), table I, method 3.
        close(wilson_95(81, 263), [0.2553, 0.3662]);
        close(wilson_95(15, 148), [0.0624, 0.1605]);
        close(wilson_95(0, 20), [0.0, 0.1611]);
        close(wilson_95(1, 29), [0.0061, 0.1718]);
    }

    #[test]
    fn ends_are_exact_and_mirror_each_other() {
        assert_eq!(wilson_95(0, 0), [0.0, 1.0]);
        assert_eq!(wilson_95(500, 500)[1], 1.0);
        let ([low, high], [other_low, other_high]) = (wilson_95(490, 500), wilson_95(10, 500));
        close([low, high], [1.0 - other_high, 1.0 - other_low]);
        assert!(low < 0.98 && 0.98 < high);
    }
}
