//! Which compilation of the kernel runs.

use super::trial;
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
    Avx512Vl,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Portable,
}

/// Lets the environment variable `HILT_KERNEL` (`avx512`, `avx512vl`, `avx2` or `portable`) choose the kernel, for tests and measurements.
/// Without it the fastest one that the processor has runs, found by a trial of a millisecond. To be called before the first product.
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

/// The kernel that runs, and how fast those that could are here, for who asks a program what it is.
pub fn describe() -> String {
    let trials: Vec<String> = trial::rates().iter().map(|(path, rate)| format!("{} {:.0}", path.name(), rate / 1e9)).collect();
    let speeds =
        if trials.is_empty() { String::new() } else { format!(" (GFLOP/s of a core, in a short trial: {})", trials.join(", ")) };
    format!("{}{speeds}", Path::best().name())
}

impl Path {
    /// All, the widest registers first.
    const ALL: &[Path] = &[
        #[cfg(target_arch = "x86_64")]
        Path::Avx512,
        #[cfg(target_arch = "x86_64")]
        Path::Avx512Vl,
        #[cfg(target_arch = "x86_64")]
        Path::Avx2,
        Path::Portable,
    ];

    /// The one that runs: the fastest, unless [`choose`] chose another.
    pub fn best() -> Path {
        *CHOSEN.get_or_init(trial::fastest)
    }

    /// Those that this processor has, the widest registers first.
    pub fn available() -> impl Iterator<Item = Path> {
        Path::ALL.iter().copied().filter(|path| path.runs_here())
    }

    fn name(self) -> &'static str {
        match self {
            #[cfg(target_arch = "x86_64")]
            Path::Avx512 => "avx512",
            #[cfg(target_arch = "x86_64")]
            Path::Avx512Vl => "avx512vl",
            #[cfg(target_arch = "x86_64")]
            Path::Avx2 => "avx2",
            Path::Portable => "portable",
        }
    }

    #[cfg(target_arch = "x86_64")]
    fn runs_here(self) -> bool {
        use std::arch::is_x86_feature_detected as has;
        let avx2 = has!("avx2") && has!("fma");
        let avx512vl = avx2 && has!("avx512f") && has!("avx512vl");
        match self {
            Path::Avx512 => avx512vl && has!("avx512dq"),
            Path::Avx512Vl => avx512vl,
            Path::Avx2 => avx2,
            Path::Portable => true,
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn runs_here(self) -> bool {
        true
    }

    /// The path of this name.
    fn named(name: &OsStr) -> Result<Path> {
        Path::available().find(|path| name == path.name()).ok_or_else(|| {
            let names: Vec<&str> = Path::available().map(Path::name).collect();
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
        for path in Path::available() {
            assert_eq!(Path::named(OsStr::new(path.name())).expect("it runs here"), path);
        }
        for name in ["", "AVX2", "sse9"] {
            let error = Path::named(OsStr::new(name)).expect_err("no kernel");
            assert_eq!(error.exit_code(None), 2);
            assert!(error.to_string().contains("allowed: ") && error.to_string().contains("portable"), "{error}");
        }
    }
}
