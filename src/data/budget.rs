//! How much memory the content of files may take: in proportion to what they are, so that a small file cannot hold gigabytes.

/// Allowed whatever the size of the file \[bytes\].
const BASE_BYTES: u64 = 128 << 20;
/// Allowed for each byte of a file. What hilt writes is numbers that hardly compress: it unpacks to some 2 bytes.
const BYTES_PER_BYTE: u64 = 16;

/// Bytes that may still be taken.
pub(super) struct Budget {
    left: u64,
}

impl Budget {
    /// Before the first file.
    pub(super) fn new() -> Self {
        Budget { left: BASE_BYTES }
    }

    /// Adds what a file of `bytes` bytes may unpack to.
    pub(super) fn allow_for(&mut self, bytes: u64) {
        self.left = self.left.saturating_add(bytes.saturating_mul(BYTES_PER_BYTE));
    }

    /// Takes `bytes`.
    ///
    /// # Errors
    /// Says that the content is too large.
    pub(super) fn take(&mut self, bytes: u64) -> Result<(), String> {
        self.left = self.left.checked_sub(bytes).ok_or_else(|| {
            format!("unpacks to more than {} MB and {BYTES_PER_BYTE} times its size, no file of hilt does", BASE_BYTES >> 20)
        })?;
        Ok(())
    }
}
