//! Functions that round the same everywhere. What `f64::sin` and its like call is the system's, and its last digit depends on the
//! processor (with FMA or without) and on the system's version; these are computed by the binary itself. Sums, products, quotients and
//! roots are exact to the last digit on every processor and stay as they are. `clippy.toml` holds this.

/// e^x.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// e^x in f32, by way of f64: so it is the nearest f32 but for one in a billion.
pub fn exp_f32(x: f32) -> f32 {
    libm::exp(f64::from(x)) as f32
}

/// The natural logarithm.
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// The decimal logarithm.
pub fn log10(x: f64) -> f64 {
    libm::log10(x)
}

/// x^exponent.
pub fn pow(x: f64, exponent: f64) -> f64 {
    libm::pow(x, exponent)
}

/// Sine and cosine of an angle \[rad\].
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    libm::sincos(angle_rad)
}

/// Cosine of an angle \[rad\].
pub fn cos(angle_rad: f64) -> f64 {
    libm::cos(angle_rad)
}

/// The angle of this cosine \[rad\].
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}

/// The hyperbolic tangent.
pub fn tanh(x: f64) -> f64 {
    libm::tanh(x)
}

/// The square root of x^2 + y^2.
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bits themselves, so that another version of the functions, or another processor, cannot change them unseen.
    #[test]
    fn results_are_these_bits_on_every_processor() {
        let mut hash = blake3::Hasher::new();
        for i in 1..20_000u32 {
            let x = f64::from(i) * 0.000_713;
            let (sin, cosine) = sin_cos(x);
            let all = [
                exp(-x),
                exp(x),
                ln(x),
                log10(x),
                pow(0.999, x),
                pow(x, 1.7),
                sin,
                cosine,
                cos(-x),
                acos(x / 15.0),
                hypot(x, 0.37),
            ];
            all.iter().for_each(|y| _ = hash.update(&y.to_le_bytes()));
            hash.update(&exp_f32(x as f32 - 7.0).to_le_bytes());
        }
        assert_eq!(hash.finalize().to_hex().as_str(), "af3518a3be1991c992e6055c42f97b71e0cfa046667a88a98e281b3745bd1017");
    }
}
