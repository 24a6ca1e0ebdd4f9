//! A robot from its two files: a URDF, and a small TOML beside it that says what a URDF cannot.

mod assemble;
mod body;
pub mod built_in;
pub mod description;
mod mesh;
mod tree;
mod xml;

use crate::error::{Error, Result};
use crate::words::shown;
use assemble::assemble;
use description::{Description, Read};
use std::fs;
use std::path::{Path, PathBuf};

/// Reads a robot from its TOML file and the URDF that it names.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read; [`Error::Input`] names the file, what is wrong in it, and what to do.
pub fn read(path: &Path) -> Result<Read> {
    let description = Description::parse(&text_of(path)?).map_err(|why| Error::input(path, why))?;
    let directory = path.parent().unwrap_or(Path::new("."));
    let urdf = directory.join(&description.urdf);
    let document = xml::read(&text_of(&urdf)?).map_err(|why| Error::input(&urdf, why))?;
    let places = [directory.to_path_buf(), urdf.parent().unwrap_or(Path::new(".")).to_path_buf()];
    let mesh = |name: &str| mesh_path(name, &description, &places);
    assemble(&description, &document, &mesh).map_err(|why| Error::input(path, why))
}

fn text_of(path: &Path) -> Result<String> {
    let io = |e| Error::io(path, "read", e);
    if fs::metadata(path).map_err(io)?.len() > xml::LONGEST_FILE {
        return Err(Error::input(path, format!("longer than {} bytes: no description of a robot", xml::LONGEST_FILE)));
    }
    String::from_utf8(fs::read(path).map_err(io)?).map_err(|_| Error::input(path, "not UTF-8 text"))
}

/// Where a mesh is that a URDF names.
fn mesh_path(name: &str, description: &Description, places: &[PathBuf]) -> std::result::Result<PathBuf, String> {
    let plain = name.strip_prefix("file://").unwrap_or(name);
    let candidates: Vec<PathBuf> = match plain.strip_prefix("package://") {
        None => places.iter().map(|place| place.join(plain)).collect(),
        Some(rest) => {
            let (package, file) = rest.split_once('/').unwrap_or((rest, ""));
            let told = description.packages.get(package).map(|at| places[0].join(at).join(file));
            let above = places.iter().flat_map(|place| place.ancestors()).map(|place| place.join(rest));
            told.into_iter().chain(above).collect()
        }
    };
    candidates.into_iter().find(|path| path.is_file()).ok_or_else(|| {
        let name = shown(name);
        format!(
            "the mesh {name} is not there: put it beside the URDF, say where its package is under [packages], or give [shapes]"
        )
    })
}
