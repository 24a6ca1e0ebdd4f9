//! A robot from its two files: a URDF, and a small TOML beside it that says what a URDF cannot.

mod assemble;
mod body;
pub mod built_in;
pub mod description;
mod draft;
mod mesh;
mod read_urdf;
mod tree;

use crate::error::{Error, Result};
use crate::interrupt::{self, Interrupt};
use crate::words::shown;
use assemble::assemble;
use description::{Description, Read};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf, absolute};

/// Reads a robot from its TOML file and the URDF that it names.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read; [`Error::Input`] names the file, what is wrong in it, and what to do.
pub fn read(path: &Path) -> Result<Read> {
    let description = Description::parse(&text_of(path)?).map_err(|why| Error::input(path, why))?;
    let directory = path.parent().unwrap_or(Path::new("."));
    let urdf = directory.join(&description.urdf);
    let document = read_urdf::read(&text_of(&urdf)?).map_err(|why| Error::input(&urdf, why))?;
    let places = [directory_of(path), directory_of(&urdf)];
    let mesh = |name: &str| mesh_path(name, &description.packages, &places);
    assemble(&description, &document, &mesh).map_err(|why| Error::input(path, why))
}

/// The TOML of a robot as far as its URDF tells, to stand beside it: a person goes on from there.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read; [`Error::Input`] says what is wrong in it, or lacks: a hand of two fingers that close on each other.
pub fn draft(urdf: &Path, interrupt: &Interrupt) -> Result<String> {
    let document = read_urdf::read(&text_of(urdf)?).map_err(|why| Error::input(urdf, why))?;
    let places = [directory_of(urdf)];
    draft::draft(urdf, &document, &|name| mesh_path(name, &BTreeMap::new(), &places), interrupt)
}

fn text_of(path: &Path) -> Result<String> {
    let bytes = interrupt::read_at_most(path, read_urdf::LONGEST_FILE).map_err(|e| Error::io(path, "read", e))?;
    if bytes.len() as u64 > read_urdf::LONGEST_FILE {
        return Err(Error::input(path, format!("longer than {} bytes: no description of a robot", read_urdf::LONGEST_FILE)));
    }
    String::from_utf8(bytes).map_err(|_| Error::input(path, "not UTF-8 text"))
}

/// Absolute, so that packages are found in any directory above it.
fn directory_of(path: &Path) -> PathBuf {
    let path = absolute(path).unwrap_or_else(|_| path.to_path_buf());
    path.parent().unwrap_or(Path::new("/")).to_path_buf()
}

/// Where a mesh is that a URDF names.
fn mesh_path(name: &str, packages: &BTreeMap<String, PathBuf>, places: &[PathBuf]) -> std::result::Result<PathBuf, String> {
    let plain = name.strip_prefix("file://").unwrap_or(name);
    let candidates: Vec<PathBuf> = match plain.strip_prefix("package://") {
        None => places.iter().map(|place| place.join(plain)).collect(),
        Some(rest) => {
            let (package, file) = rest.split_once('/').unwrap_or((rest, ""));
            let told = packages.get(package).map(|at| places[0].join(at).join(file));
            // In the directory of that name above the files; else where the package's directory has another name.
            let above = |path: &str| places.iter().flat_map(|place| place.ancestors()).map(|place| place.join(path)).collect();
            let (named, renamed): (Vec<PathBuf>, Vec<PathBuf>) = (above(rest), above(file));
            told.into_iter().chain(named).chain(renamed).collect()
        }
    };
    candidates.into_iter().find(|path| path.is_file()).ok_or_else(|| {
        let name = shown(name);
        format!(
            "the mesh {name} is not there: put it beside the URDF, say where its package is under [packages], or give [shapes]"
        )
    })
}
