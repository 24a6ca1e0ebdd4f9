//! What of a robot moves together: links that are fixed to each other become one.

use super::description::ShapeEntry;
use super::mesh::bounds_of_stl;
use super::read_urdf::{Geometry, LinkElement, isometry};
use crate::robot::model::{Inertia, Link, Shape};
use crate::words::shown;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use std::path::PathBuf;

/// Ends of a capsule are recognised within this \[m\].
const SAME_M: f64 = 1e-9;
/// Products of inertia below this share of the moments are what rounding leaves of none.
const ROUNDING: f64 = 1e-12;
/// Rotations nearer to none than this are none \[rad\].
pub const ALIGNED_RAD: f64 = 1e-12;

/// Finds a mesh by its name.
pub type FindMesh<'a> = &'a dyn Fn(&str) -> Result<PathBuf, String>;

/// Masses and shapes in the frame of the first link.
pub struct Body {
    /// Name of the first link.
    pub name: String,
    masses: Vec<(Isometry3<f64>, f64, Matrix3<f64>)>,
    shapes: Vec<Shape>,
}

impl Body {
    /// Nothing yet.
    pub fn new(name: &str) -> Self {
        Body { name: name.into(), masses: Vec::new(), shapes: Vec::new() }
    }

    /// Takes in a link that stands at `at`; `own` shapes stand for its geometry. What is replaced is said in `remarks`.
    ///
    /// # Errors
    /// Names a mesh that is not there or cannot be read.
    pub fn take(
        &mut self,
        link: &LinkElement,
        at: Isometry3<f64>,
        own: Option<&Vec<ShapeEntry>>,
        mesh: FindMesh,
        remarks: &mut Vec<String>,
    ) -> Result<(), String> {
        if let Some((com, mass, [xx, yy, zz, xy, xz, yz])) = link.inertial {
            let moments = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            self.masses.push((at * com, mass, moments));
        }
        let shapes = match own {
            Some(own) => own.iter().map(own_shape).collect(),
            None => shapes(link, mesh, remarks)?,
        };
        let placed = |shape: Shape| match shape {
            Shape::Box { pose, half_m } => Shape::Box { pose: at * pose, half_m },
            Shape::Capsule { from_m, to_m, radius_m } => {
                let moved = |p: [f64; 3]| (at * Point3::from(p)).coords.into();
                Shape::Capsule { from_m: moved(from_m), to_m: moved(to_m), radius_m }
            }
        };
        self.shapes.extend(shapes.into_iter().map(|shape| if at == Isometry3::identity() { shape } else { placed(shape) }));
        Ok(())
    }

    /// As one link.
    ///
    /// # Errors
    /// When it moves and has no mass, or moments of inertia that are not above 0.
    pub fn link(&self, is_foot: bool) -> Result<Link, String> {
        let name = shown(&self.name);
        let mass_kg: f64 = self.masses.iter().map(|(_, mass, _)| mass).sum();
        let one = self.masses.len() == 1;
        if !is_foot && (mass_kg <= 0.0 || self.masses.is_empty()) {
            return Err(format!("link \"{name}\" moves, but has no mass: give it an <inertial> with mass and inertia"));
        }
        let com = match &self.masses[..] {
            [(com, ..)] => com.translation.vector,
            masses => {
                masses.iter().map(|(com, mass, _)| com.translation.vector * *mass).sum::<Vector3<f64>>()
                    / mass_kg.max(f64::MIN_POSITIVE)
            }
        };
        let mut moments = Matrix3::zeros();
        for (at, mass, own) in &self.masses {
            let (turn, off) = (at.rotation.to_rotation_matrix(), at.translation.vector - com);
            let turned = if at.rotation.angle() < ALIGNED_RAD { *own } else { turn.matrix() * own * turn.matrix().transpose() };
            let shift = (Matrix3::identity() * off.norm_squared() - off * off.transpose()) * *mass;
            moments += if one { turned } else { turned + shift };
        }
        let off = moments[(0, 1)].abs().max(moments[(0, 2)].abs()).max(moments[(1, 2)].abs());
        let diagonal = off <= ROUNDING * moments.trace().abs();
        let (principal, axes) = if diagonal {
            (moments.diagonal(), UnitQuaternion::identity())
        } else {
            let eigen = moments.symmetric_eigen();
            let mut axes = eigen.eigenvectors;
            if axes.determinant() < 0.0 {
                axes.column_mut(2).neg_mut();
            }
            // Not `UnitQuaternion::from_matrix`, which searches for the rotation and does not find half turns.
            (eigen.eigenvalues, UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)))
        };
        let [a, b, c] = [principal.x, principal.y, principal.z];
        if !is_foot && a.min(b).min(c) <= 0.0 {
            return Err(format!("link \"{name}\": moments of inertia {a:.3e}, {b:.3e}, {c:.3e} kg m^2; each must be above 0"));
        }
        let inertia = Inertia { mass_kg, com_m: com.into(), principal_kg_m2: principal.into(), axes };
        Ok(Link { name: self.name.clone(), inertia, shapes: self.shapes.clone() })
    }
}

/// What hilt makes of the geometry of a link: a cylinder with two spheres at its ends is a capsule.
fn shapes(link: &LinkElement, mesh: FindMesh, remarks: &mut Vec<String>) -> Result<Vec<Shape>, String> {
    let (name, mut used) = (shown(&link.name), vec![false; link.collisions.len()]);
    let mut shapes = Vec::new();
    for (i, (pose, geometry)) in link.collisions.iter().enumerate() {
        let Geometry::Cylinder(radius, length) = geometry else { continue };
        let end = |sign: f64| pose * Point3::new(0.0, 0.0, sign * length / 2.0);
        let cap = |at: Point3<f64>| {
            link.collisions.iter().position(|(pose, geometry)| {
                *geometry == Geometry::Sphere(*radius) && (pose.translation.vector - at.coords).norm() < SAME_M
            })
        };
        if let (Some(a), Some(b)) = (cap(end(-1.0)), cap(end(1.0))) {
            let (a, b) = (a.min(b), a.max(b));
            [i, a, b].into_iter().for_each(|k| used[k] = true);
            let at = |k: usize| link.collisions[k].0.translation.vector.into();
            shapes.push((i, Shape::Capsule { from_m: at(a), to_m: at(b), radius_m: *radius }));
        }
    }
    for (i, (pose, geometry)) in link.collisions.iter().enumerate().filter(|(i, _)| !used[*i]) {
        let shape = match geometry {
            Geometry::Box(size) => Shape::Box { pose: *pose, half_m: size.map(|s| s / 2.0) },
            Geometry::Sphere(radius) => {
                let at = pose.translation.vector.into();
                Shape::Capsule { from_m: at, to_m: at, radius_m: *radius }
            }
            Geometry::Cylinder(radius, length) => {
                remarks.push(format!("a cylinder of link {name} becomes the box around it"));
                Shape::Box { pose: *pose, half_m: [*radius, *radius, length / 2.0] }
            }
            Geometry::Mesh(file, scale) => {
                let path = mesh(file).map_err(|why| format!("link \"{name}\": {why}"))?;
                let (low, high) = bounds_of_stl(&path, *scale).map_err(|why| format!("link \"{name}\": {why}"))?;
                remarks.push(format!("the mesh of link {name} becomes the box around it; [shapes] can say better"));
                let middle: [f64; 3] = std::array::from_fn(|k| (low[k] + high[k]) / 2.0);
                Shape::Box { pose: pose * Translation3::from(middle), half_m: std::array::from_fn(|k| (high[k] - low[k]) / 2.0) }
            }
        };
        shapes.push((i, shape));
    }
    shapes.sort_by_key(|(i, _)| *i);
    Ok(shapes.into_iter().map(|(_, shape)| shape).collect())
}

fn own_shape(entry: &ShapeEntry) -> Shape {
    match *entry {
        ShapeEntry::Capsule { from_m, to_m, radius_m } => Shape::Capsule { from_m, to_m, radius_m },
        ShapeEntry::Box { center_m, half_m, rpy_rad } => Shape::Box { pose: isometry(center_m, rpy_rad), half_m },
    }
}
