//! How a dataset is cut.

use super::meta::DATA_FILE_MB;

/// How a dataset is cut.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    /// A file is closed once it is this big \[bytes\].
    pub(super) file_bytes: usize,
    /// Frames that are in memory at once, but for an episode that has more.
    pub(super) window_frames: usize,
    /// Episodes of a row group of the table of episodes.
    pub(super) table_rows: usize,
}

impl Sizes {
    /// Of all datasets: LeRobot's own 100 MB; some 180 pick-ups, which take 15 MB with all that is made of them; rows that take 20 kB each.
    pub(super) const USUAL: Sizes = Sizes { file_bytes: DATA_FILE_MB * 1_000_000, window_frames: 1 << 14, table_rows: 1000 };
}
