//! Fused multiply-add in software: what the instruction gives, bit for bit, on a processor that lacks it.

/// factor * other + summand, rounded once.
///
/// The product of two f32 is exact in f64. The sum is not; were it rounded to f64 and then to f32, a sum that the first step carries onto
/// the middle between two f32 would be rounded the wrong way. So the f64 is rounded to odd: cut off, and its last bit set where anything
/// was cut off. Such a number never lies in the middle, and f64 has more than twice the digits of f32 and two, so that the second step
/// then gives the f32 next to the exact sum, subnormal ones included (Boldo and Melquiond, 2008).
#[inline(always)]
pub fn times_plus(factor: f32, other: f32, summand: f32) -> f32 {
    let (product, summand) = (f64::from(factor) * f64::from(other), f64::from(summand));
    let sum = product + summand;
    // What rounding the sum took away, exactly (Knuth's TwoSum); NaN where something is infinite or NaN.
    let added = sum - product;
    let error = (product - (sum - added)) + (summand - added);
    let inexact = if error.abs() > 0.0 { u64::MAX } else { 0 };
    // The sum was rounded away from 0 where its sign is not the error's.
    let away = (sum.to_bits() ^ error.to_bits()) >> 63;
    let cut = sum.to_bits() - (away & inexact);
    f64::from_bits(cut | (inexact & 1)) as f32
}

#[cfg(test)]
mod tests {
    use super::times_plus;
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Numbers at which rounding changes its ways.
    const EDGES: [u32; 16] = [
        0,
        1,
        2,
        0x7f_ffff,
        0x80_0000,
        0x80_0001,
        0x3f7f_ffff,
        0x3f80_0000,
        0x3f80_0001,
        0x3f80_0800,
        0x4b7f_ffff,
        0x4b80_0000,
        0x7f7f_ffff,
        0x7f80_0000,
        0x7fc0_0000,
        0x0c80_0000,
    ];

    /// `v` with an exponent from `least` on, one of `count`.
    fn scaled(v: f32, least: u32, count: u32) -> f32 {
        f32::from_bits(v.to_bits() & 0x807f_ffff | (least + (v.to_bits() >> 7) % count) << 23)
    }

    /// A few steps up or down from `v`, and either sign.
    fn beside(v: f32, rng: &mut impl Rng) -> f32 {
        let bits = v.to_bits().wrapping_add(rng.random_range(0..5)).wrapping_sub(2);
        f32::from_bits(bits ^ u32::from(rng.random::<bool>()) << 31)
    }

    /// A product and a summand, of six kinds in turn.
    fn triple(kind: u32, rng: &mut impl Rng) -> [f32; 3] {
        let [a, b, c]: [f32; 3] = std::array::from_fn(|_| f32::from_bits(rng.next_u32()));
        let few_digits = |v: f32| f32::from_bits(scaled(v, 100, 54).to_bits() & 0xffff_f000);
        match kind % 6 {
            0 => [a, b, c],
            1 => std::array::from_fn(|_| beside(f32::from_bits(EDGES[rng.random_range(0..EDGES.len())]), rng)),
            // exact sums, many of them in the middle between two f32
            2 => [few_digits(a), few_digits(b), scaled(c, 100, 54)],
            // cancellation
            3 => {
                let [a, b] = [scaled(a, 110, 30), scaled(b, 110, 30)];
                [a, b, beside(-a * b, rng)]
            }
            // subnormal results
            4 => [scaled(a, 40, 30), scaled(b, 55, 30), scaled(c, 0, 6)],
            // nearly in the middle, on one side of it by less than f64 tells
            _ => [beside(1.0, rng), beside(f32::EPSILON / 2.0, rng), beside(scaled(1.0, 125, 5), rng)],
        }
    }

    fn equals_the_instruction(seed: u64, count: u32) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for kind in 0..count {
            let [a, b, c] = triple(kind, &mut rng);
            let (got, fused) = (times_plus(a, b, c), a.mul_add(b, c));
            let same = got.to_bits() == fused.to_bits() || got.is_nan() && fused.is_nan();
            assert!(same, "{:08x?}: {got:e}, not {fused:e}", [a, b, c].map(f32::to_bits));
        }
    }

    #[test]
    fn the_sum_is_rounded_once() {
        equals_the_instruction(1, 1_000_000);
        // below the middle by 2^-70: f64 takes it for the middle, whose even neighbour is the upper one
        let odd = 1.0 + f32::EPSILON;
        let (a, b) = (odd, f32::EPSILON / 2.0 * (1.0 - f32::EPSILON));
        assert_eq!(times_plus(a, b, odd), odd);
        assert!((f64::from(a) * f64::from(b) + f64::from(odd)) as f32 > odd);
        for (a, b, c) in [(0.0, -1.0, 0.0), (0.0, -1.0, -0.0), (1.0, -1.0, 1.0), (1e-40, 1e-40, -0.0), (-1e-40, 1e-40, 0.0)] {
            assert_eq!(times_plus(a, b, c).to_bits(), a.mul_add(b, c).to_bits(), "{a} * {b} + {c}");
        }
    }

    /// Opt-in: `cargo test --release --lib fused -- --ignored`.
    #[test]
    #[ignore = "seconds of a free processor, minutes of a busy one: the same with many more numbers"]
    fn the_sum_is_rounded_once_of_half_a_billion() {
        equals_the_instruction(2, 500_000_000);
    }
}
