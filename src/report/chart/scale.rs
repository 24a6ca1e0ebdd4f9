//! From values to places along an axis, and where its ticks stand.

use crate::math;

/// What the horizontal axis counts.
#[derive(Clone, Debug, PartialEq)]
pub enum Axis {
    /// Numbers from 0.
    Linear,
    /// Positive numbers, each decade as wide as the next.
    Log,
}

/// An axis over the values that it has to show.
pub(super) struct Scale {
    low: f64,
    high: f64,
    log: bool,
    pub(super) ticks: Vec<(f64, String)>,
}

/// Ticks of a linear axis, at most.
const MOST_TICKS: f64 = 6.0;
/// A value on a tick lies there, however the division is rounded.
const ROUNDING: f64 = 1e-9;
/// Parts of a decade that have ticks, by how many decades the axis has at most; beyond, only their beginnings have.
const DECADE: [(f64, &[f64]); 2] = [(1.0, &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]), (2.0, &[1.0, 2.0, 5.0])];
/// A logarithmic axis begins below and ends above its values by this part.
const MARGIN: f64 = 1.25;

impl Scale {
    /// Over all values that are finite (and above 0 on a logarithmic axis).
    pub(super) fn over(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        match axis {
            Axis::Linear => Scale::linear(values.filter(|v| v.is_finite()).fold(0.0, f64::max)),
            Axis::Log => {
                let within = |ends: [f64; 2], v: f64| [ends[0].min(v), ends[1].max(v)];
                let [low, high] = values.filter(|v| v.is_finite() && *v > 0.0).fold([f64::MAX, 0.0], within);
                if high > 0.0 { Scale::log(low / MARGIN, high * MARGIN) } else { Scale::log(1.0, 10.0) }
            }
        }
    }

    /// From a little below the lowest of some values to a little above the highest.
    pub(super) fn between(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = values.filter(|v| v.is_finite()).fold([f64::MAX, f64::MIN], |[low, high], v| [low.min(v), high.max(v)]);
        if low > high {
            return Scale::linear(1.0);
        }
        // Of a value that does not change, the axis shows what is around it.
        let apart = if high > low { high - low } else { high.abs().max(f64::MIN_POSITIVE) };
        let step = step_within(apart * (1.0 - ROUNDING));
        let (first, last) = ((low / step + ROUNDING).floor(), (high / step - ROUNDING).ceil());
        let last = if last > first { last } else { first + 1.0 };
        let ticks = (0..=(last - first) as u32).map(|i| (first + f64::from(i)) * step).map(|v| (v, number(v))).collect();
        Scale { low: first * step, high: last * step, log: false, ticks }
    }

    /// From 0 to `most`, or a little more.
    fn linear(most: f64) -> Self {
        let most = if most > 0.0 { most } else { 1.0 };
        let step = step_within(most);
        let count = (most / step).ceil() as u32;
        let ticks = (0..=count).map(|i| (f64::from(i) * step, number(f64::from(i) * step))).collect();
        Scale { low: 0.0, high: f64::from(count) * step, log: false, ticks }
    }

    fn log(low: f64, high: f64) -> Self {
        let (first, last) = (math::log10(low).floor() as i32, math::log10(high).ceil() as i32);
        let decades = math::log10(high / low);
        let within = DECADE.into_iter().find(|(most, _)| decades <= *most).map_or(&[1.0][..], |(_, within)| within);
        let at = |exponent: i32, times: f64| times * math::pow(10.0, f64::from(exponent));
        let all = (first..=last).flat_map(|exponent| within.iter().map(move |times| at(exponent, *times)));
        let ticks = all.filter(|v| (low..=high).contains(v)).map(|v| (v, number(v))).collect();
        Scale { low, high, log: true, ticks }
    }

    /// Where a value stands between the ends, 0 to 1.
    pub(super) fn share(&self, value: f64) -> f64 {
        let along = |v: f64| if self.log { math::ln(v) } else { v };
        (along(value) - along(self.low)) / (along(self.high) - along(self.low))
    }

    /// Whether the axis has a place for it.
    pub(super) fn holds(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }
}

/// A round step of which at most [`MOST_TICKS`] fit into a range.
fn step_within(range: f64) -> f64 {
    let decade = math::pow(10.0, math::log10(range).floor() - 1.0);
    let steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0].map(|step| step * decade);
    steps.into_iter().find(|step| range / step <= MOST_TICKS).unwrap_or(range)
}

/// Steps of an axis of shares, the finest first; the first with at most [`MOST_TICKS`] steps is taken.
const SHARE_STEPS: [f64; 5] = [0.01, 0.02, 0.05, 0.1, 0.2];

/// Lower end and step of an axis that ends at 1 and shows `lowest`.
pub(super) fn up_to_one(lowest: f64) -> (f64, f64) {
    let floor = |step: f64| ((lowest / step).floor() * step).clamp(0.0, 1.0 - step);
    let fits = |step: &f64| (1.0 - floor(*step)) / step <= MOST_TICKS + 0.5;
    let step = SHARE_STEPS.into_iter().find(fits).unwrap_or(SHARE_STEPS[SHARE_STEPS.len() - 1]);
    (floor(step), step)
}

/// What is nearer to 0 is written with its power of ten.
const SMALLEST_PLAIN: f64 = 1e-3;

/// `0.5`, `200`, `50k`, `2M`, `2e-4`.
pub fn number(value: f64) -> String {
    let short = |value: f64| {
        let text = format!("{value:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    };
    match value {
        v if v >= 1e6 => short(v / 1e6) + "M",
        v if v >= 1e4 => short(v / 1e3) + "k",
        v if v != 0.0 && v.abs() < SMALLEST_PLAIN => format!("{v:.1e}").replace(".0e", "e"),
        v => short(v),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(scale: &Scale) -> Vec<&str> {
        scale.ticks.iter().map(|(_, name)| name.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_and_cover_the_values() {
        assert_eq!(ticks(&Scale::over(&Axis::Linear, [3.0, 23.0].into_iter())), ["0", "5", "10", "15", "20", "25"]);
        assert_eq!(ticks(&Scale::over(&Axis::Linear, [0.42].into_iter())), ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(ticks(&Scale::over(&Axis::Log, [1.0, 100.0].into_iter())), ["1", "10", "100"]);
        assert_eq!(ticks(&Scale::over(&Axis::Log, [10.0, 100.0].into_iter())), ["10", "20", "50", "100"]);
        assert_eq!(ticks(&Scale::over(&Axis::Log, [9e3, 4e6].into_iter())), ["10k", "100k", "1M"]);
        assert_eq!(ticks(&Scale::over(&Axis::Linear, std::iter::empty())).len(), 6);
    }

    #[test]
    fn an_axis_between_values_has_room_for_negative_ones_and_for_one_that_does_not_change() {
        assert_eq!(ticks(&Scale::between([-7.0, 12.0].into_iter())), ["-10", "-5", "0", "5", "10", "15"]);
        assert_eq!(
            ticks(&Scale::between([2e-5, 5e-5].into_iter())),
            ["2e-5", "2.5e-5", "3e-5", "3.5e-5", "4e-5", "4.5e-5", "5e-5"]
        );
        let flat = Scale::between([0.8].into_iter());
        assert!(flat.low <= 0.8 && flat.high > 0.8 && flat.ticks.len() > 1, "{:?}", flat.ticks);
        assert!(Scale::between([0.0].into_iter()).share(0.0).is_finite());
    }

    #[test]
    fn an_axis_of_shares_is_fine_near_one_and_begins_at_zero_for_low_values() {
        let close = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9;
        assert!(close(up_to_one(0.84), (0.80, 0.05)) && close(up_to_one(0.07), (0.0, 0.2)), "{:?}", up_to_one(0.84));
    }

    #[test]
    fn places_grow_with_values_from_end_to_end() {
        let log = Scale::over(&Axis::Log, [1.0, 100.0].into_iter());
        assert!((log.share(10.0) - 0.5).abs() < 1e-12 && log.share(1.0) > 0.0 && log.share(100.0) < 1.0);
        let linear = Scale::over(&Axis::Linear, [4.0].into_iter());
        assert_eq!([linear.share(0.0), linear.share(1.0)], [0.0, 0.25]);
        assert!(!log.holds(0.0) && linear.holds(0.0));
    }
}
