//! The compilations of the kernel.

use crate::error::{Error, Result};
use std::ffi::OsStr;

/// Names a compilation other than the fastest one, for tests and measurements.
pub const VARIABLE: &str = "HILT_KERNEL";

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

    /// Those that this processor has, the widest registers first.
    pub fn available() -> impl Iterator<Item = Path> {
        Path::ALL.iter().copied().filter(|path| path.runs_here())
    }

    /// Its name.
    pub fn name(self) -> &'static str {
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
    pub fn named(name: &OsStr) -> Result<Path> {
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
