//! Recovery puts the learner back on a *known* demo state. So all coins are drawn first, and each rollout falls apart into segments that
//! begin at demo states.

use crate::config::Pairs;
use rand::{Rng, RngExt};

/// Steps in the dynamics network between two demo states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// First transition, counted within the batch.
    pub start: usize,
    /// Number of predictions that enter the buffer B.
    pub steps: usize,
}

/// Draws the coins of Algorithm 3 for demos of these lengths and cuts them into segments, in order.
pub fn draw_segments(
    lengths: impl Iterator<Item = usize>,
    rho: f64,
    pairs: Pairs,
    rng: &mut impl Rng,
    segments: &mut Vec<Segment>,
) {
    segments.clear();
    let mut first = 0;
    for length in lengths {
        let (mut start, end) = (first, first + length);
        for t in first..end {
            let recovered = rng.random::<f64>() < rho;
            if recovered || t + 1 == end {
                // a pair stored after recovery is (s^E, s^E): it has neither loss nor gradient
                let steps = t + 1 - start - usize::from(recovered && pairs == Pairs::AfterRecovery);
                if steps > 0 {
                    segments.push(Segment { start, steps });
                }
                start = t + 1;
            }
        }
        first = end;
    }
}

/// Shard `i` of `count`: as much work as the others have. Long segments stay together, so that few panels are half empty.
pub fn share(sorted: &[Segment], count: usize, i: usize) -> &[Segment] {
    let work = |s: &Segment| 2 * s.steps - 1; // the first step needs only the dynamics network
    let total: usize = sorted.iter().map(work).sum();
    let cut = |i: usize| {
        let mut before = 0;
        let place = sorted.iter().position(|s| {
            before += work(s);
            before - work(s) >= total * i / count
        });
        if i < count { place.unwrap_or(sorted.len()) } else { sorted.len() }
    };
    &sorted[cut(i)..cut(i + 1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    fn segments(rho: f64, pairs: Pairs) -> Vec<Segment> {
        let mut out = Vec::new();
        draw_segments([50, 3].into_iter(), rho, pairs, &mut stream(0, "coins", 0), &mut out);
        out
    }

    #[test]
    fn shares_cover_the_segments_and_are_alike() {
        let sorted: Vec<Segment> = (0..90).map(|i| Segment { start: i, steps: 1 + (90 - i) / 9 }).collect();
        for count in 1..4 {
            let shares: Vec<&[Segment]> = (0..count).map(|i| share(&sorted, count, i)).collect();
            assert_eq!(shares.concat(), sorted);
            let work = |i: usize| shares[i].iter().map(|s| 2 * s.steps - 1).sum::<usize>();
            assert!((1..count).all(|i| work(i).abs_diff(work(0)) < 40));
        }
        assert!(share(&[], 2, 0).is_empty() && share(&[], 2, 1).is_empty());
    }

    #[test]
    fn segments_cover_the_demos() {
        assert_eq!(segments(0.0, Pairs::AfterRecovery), [Segment { start: 0, steps: 50 }, Segment { start: 50, steps: 3 }]);
        assert_eq!(segments(1.0, Pairs::BeforeRecovery).len(), 53);
        assert!(segments(1.0, Pairs::AfterRecovery).is_empty());
        let before = segments(0.4, Pairs::BeforeRecovery);
        assert_eq!(before.iter().map(|s| s.steps).sum::<usize>(), 53);
        assert!(before.iter().all(|s| s.start >= 50 || s.start + s.steps <= 50), "a segment crosses two demos");
    }
}
