//! Random streams: seed + stage + index -> its own generator, so that no result depends on threads, order or shards. And normal numbers
//! drawn from them.

use crate::math;
use rand::{Rng, SeedableRng, TryRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::convert::Infallible;

/// The generator of `stage` for item `index` (an episode, an epoch) under the run's `seed`.
///
/// ChaCha8 is value-stable across versions and platforms, which `StdRng` is not.
pub fn stream(seed: u64, stage: &str, index: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut hash = blake3::Hasher::new();
    hash.update(stage.as_bytes());
    hash.update(&index.to_le_bytes());
    let digest = hash.finalize();
    let mut id = [0u8; 8];
    id.copy_from_slice(&digest.as_bytes()[..8]);
    rng.set_stream(u64::from_le_bytes(id));
    rng
}

/// Where the tail of the normal distribution begins, which `rand_distr` draws by logarithms.
const TAIL: f64 = 3.654_152_885_361_009;

/// A number from N(0, 1), the same on every processor.
///
/// `rand_distr` takes logarithms of the system for one number in 3,700, those beyond 3.65, and their last digit depends on the
/// processor. These are computed again from the same draws: the last two, of which the first is the place in the tail.
pub fn normal(rng: &mut impl Rng) -> f64 {
    let mut remembering = Remembering { rng, last: [0; 2] };
    let value: f64 = StandardNormal.sample(&mut remembering);
    if value.abs() < TAIL {
        return value;
    }
    (TAIL - math::ln(open_unit(remembering.last[0])) / TAIL).copysign(value)
}

/// A draw as a number between 0 and 1, without either: 52 bits and a half.
fn open_unit(draw: u64) -> f64 {
    f64::from_bits(1.0f64.to_bits() | draw >> 12) - (1.0 - f64::EPSILON / 2.0)
}

/// A generator that remembers what it drew last.
struct Remembering<'a, R> {
    rng: &'a mut R,
    last: [u64; 2],
}

impl<R: Rng> TryRng for Remembering<'_, R> {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.rng.next_u32())
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.last = [self.last[1], self.rng.next_u64()];
        Ok(self.last[1])
    }

    fn try_fill_bytes(&mut self, to: &mut [u8]) -> Result<(), Infallible> {
        self.rng.fill_bytes(to);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_seed_stage_and_index_and_repeat() {
        let first = |seed, stage, index| stream(seed, stage, index).next_u64();
        assert_eq!(first(0, "plan", 3), first(0, "plan", 3));
        assert_ne!(first(0, "plan", 3), first(1, "plan", 3));
        assert_ne!(first(0, "plan", 3), first(0, "simulate", 3));
        assert_ne!(first(0, "plan", 3), first(0, "plan", 4));
    }

    #[test]
    fn normal_numbers_are_those_of_rand_distr_but_for_the_last_digit_in_the_tail() {
        let (mut ours, mut theirs) = (stream(0, "normal", 0), stream(0, "normal", 0));
        let mut tail = [0.0; 2];
        for _ in 0..300_000 {
            let (got, expected): (f64, f64) = (normal(&mut ours), StandardNormal.sample(&mut theirs));
            assert!((got - expected).abs() <= if expected.abs() < TAIL { 0.0 } else { 1e-15 * TAIL }, "{got}, not {expected}");
            if got.abs() >= TAIL {
                tail[usize::from(got > 0.0)] += 1.0;
            }
        }
        assert!(tail.iter().all(|count| (20.0..60.0).contains(count)), "{tail:?} beyond {TAIL} on either side");
        assert_eq!(ours, theirs, "as many draws");
    }

    /// The bits themselves, some eighty numbers of the tail among them.
    #[test]
    fn normal_numbers_are_these_bits_on_every_processor() {
        let (mut rng, mut hash) = (stream(0, "normal", 0), blake3::Hasher::new());
        (0..300_000).for_each(|_| _ = hash.update(&normal(&mut rng).to_le_bytes()));
        assert_eq!(hash.finalize().to_hex().as_str(), "3bcd975a20f1956d4b39b3f3f637d66563b68fb56edaed1eddab695833afd5c1");
    }
}
