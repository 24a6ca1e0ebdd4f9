//! Names that belong to nobody's data: what file browsers, file systems and editors leave beside it.

use std::path::Path;

/// What a file's name says of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// Somebody's file.
    Plain,
    /// A hidden file: perhaps somebody's own.
    Hidden,
    /// Left by a file browser, a file system or a killed process: nobody misses it.
    Litter,
}

/// Names that are litter by themselves.
const LITTER: [&str; 7] = [".DS_Store", ".localized", ".directory", "Thumbs.db", "ehthumbs.db", "desktop.ini", "Icon\r"];
/// Names that begin so are litter: NFS's files that are still open, macOS's attributes on foreign file systems.
const LITTER_BEGINS: [&str; 3] = [".nfs", "._", ".fuse_hidden"];

/// Of a path: what its last name says.
pub fn kind_of_name(path: &Path) -> FileKind {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if LITTER.contains(&&*name) || LITTER_BEGINS.iter().any(|begin| name.starts_with(begin)) || super::atomic::is_temporary(&name)
    {
        return FileKind::Litter;
    }
    if name.starts_with('.') { FileKind::Hidden } else { FileKind::Plain }
}
