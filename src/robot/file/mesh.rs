//! The box around a mesh.

use crate::interrupt;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Largest mesh that is read \[bytes\].
const LARGEST_FILE: u64 = 64 << 20;

/// Lowest and highest x, y and z of an STL file, scaled \[m\].
///
/// # Errors
/// Says what is wrong with the file.
pub fn bounds_of_stl(path: &Path, scale: [f64; 3]) -> Result<([f64; 3], [f64; 3]), String> {
    let shown = path.display();
    let stl = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("stl"));
    if !stl {
        return Err(format!("{shown}: hilt reads meshes in STL; convert it, or give [shapes]"));
    }
    let unreadable = |why: std::io::Error| format!("{shown}: {why}");
    let _waits = interrupt::waiting();
    let file = File::open(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.len() > LARGEST_FILE {
        return Err(format!("{shown}: larger than {LARGEST_FILE} bytes; give [shapes]"));
    }
    let mesh = stl_io::read_stl(&mut BufReader::new(file)).map_err(unreadable)?;
    let mut bounds = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for vertex in &mesh.vertices {
        for (k, factor) in scale.iter().enumerate() {
            let value = f64::from(vertex[k]) * factor;
            if !value.is_finite() {
                return Err(format!("{shown}: a vertex is not finite"));
            }
            (bounds.0[k], bounds.1[k]) = (bounds.0[k].min(value), bounds.1[k].max(value));
        }
    }
    if mesh.vertices.is_empty() {
        return Err(format!("{shown}: no triangle in it"));
    }
    Ok(bounds)
}
