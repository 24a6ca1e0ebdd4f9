//! Which compilation of the kernel runs.

use crate::error::{Error, Result};
use std::ffi::OsStr;
use std::sync::OnceLock;

/// Names a compilation other than the fastest one, for tests and measurements.
const VARIABLE: &str = "HILT_KERNEL";

/// The one that runs in this process.
static CHOSEN: OnceLock<Path> = OnceLock::new();

/// A compilation. The results have the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Portable,
}

/// Lets the environment variable `HILT_KERNEL` (`avx512`, `avx2` or `portable`) choose the kernel, for tests and measurements. Without it
/// the fastest one that the processor has runs. To be called before the first product.
///
/// # Errors
/// [`Error::Usage`] when the value is no kernel, or one that this processor lacks.
pub fn choose() -> Result<()> {
    if let Some(name) = std::env::var_os(VARIABLE) {
        let path = Path::named(&name)?;
        CHOSEN.get_or_init(|| path);
    }
    Ok(())
}

impl Path {
    /// All, fastest first.
    const ALL: &[(&str, Path)] = &[
        #[cfg(target_arch = "x86_64")]
        ("avx512", Path::Avx512),
        #[cfg(target_arch = "x86_64")]
        ("avx2", Path::Avx2),
        ("portable", Path::Portable),
    ];

    /// The one that runs: the fastest, unless [`choose`] chose another.
    pub fn best() -> Path {
        *CHOSEN.get_or_init(|| Path::available().next().map_or(Path::Portable, |(_, path)| *path))
    }

    /// Those that this processor has, fastest first.
    pub fn available() -> impl Iterator<Item = &'static (&'static str, Path)> {
        Path::ALL.iter().filter(|(_, path)| path.runs_here())
    }

    fn runs_here(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        let (avx2, avx512) = (
            std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma"),
            std::arch::is_x86_feature_detected!("avx512f") && std::arch::is_x86_feature_detected!("avx512vl"),
        );
        match self {
            #[cfg(target_arch = "x86_64")]
            Path::Avx512 => avx2 && avx512,
            #[cfg(target_arch = "x86_64")]
            Path::Avx2 => avx2,
            Path::Portable => true,
        }
    }

    /// The path of this name.
    fn named(name: &OsStr) -> Result<Path> {
        let found = Path::available().find(|(known, _)| name == *known);
        found.map(|(_, path)| *path).ok_or_else(|| {
            let names: Vec<&str> = Path::available().map(|(name, _)| *name).collect();
            Error::Usage(format!(
                "{VARIABLE}=\"{}\" names no kernel that this processor can run; allowed: {}; unset it to take the fastest",
                name.display(),
                names.join(", ")
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_known_by_name_and_others_refused() {
        for (name, path) in Path::available() {
            assert_eq!(Path::named(OsStr::new(name)).expect("it runs here"), *path);
        }
        for name in ["", "AVX2", "sse9"] {
            let error = Path::named(OsStr::new(name)).expect_err("no kernel");
            assert_eq!(error.exit_code(None), 2);
            assert!(error.to_string().contains("allowed: ") && error.to_string().contains("portable"), "{error}");
        }
    }
}
