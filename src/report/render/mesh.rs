//! Closed triangle meshes of the primitives, tessellated once in their own frame.

use crate::math::sin_cos;
use crate::robot::model::Shape;
use crate::task;
use nalgebra::{Isometry3, Rotation3, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// How round what is round is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// Corners around a capsule.
    pub around: usize,
    /// Rings of its half sphere.
    pub rings: usize,
}

impl Detail {
    /// Round enough that an outline shows no edges at README size.
    pub const FINE: Detail = Detail { around: 20, rings: 5 };
    /// Half of the triangles: a page draws them sixty times a second, on some machines without a graphics processor.
    pub const LIGHT: Detail = Detail { around: 16, rings: 3 };
}

/// Corners around a cylinder.
const AROUND: usize = Detail::FINE.around;

/// A point of a surface with its outward normal.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// \[m\].
    pub at: Vector3<f32>,
    /// Unit length.
    pub normal: Vector3<f32>,
}

/// Triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corner points.
    pub vertices: Vec<Vertex>,
    /// Indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The surface of a collision primitive, and where it is in its link's frame.
    pub fn of_shape(shape: &Shape, detail: Detail) -> (Self, Isometry3<f64>) {
        match *shape {
            Shape::Box { pose, half_m } => (Mesh::cuboid([0.0; 3], half_m), pose),
            Shape::Capsule { from_m, to_m, radius_m } => {
                (Mesh::capsule(from_m.into(), to_m.into(), radius_m, detail), Isometry3::identity())
            }
        }
    }

    /// The surface of an object, in its own frame.
    pub fn of_object(shape: &task::Shape) -> Self {
        if let task::Shape::Cylinder { radius_m, height_m } = *shape {
            return Mesh::cylinder(radius_m, height_m / 2.0);
        }
        let mut mesh = Mesh::default();
        shape.boxes_m().into_iter().for_each(|(center, half)| mesh.append(&Mesh::cuboid(center, half)));
        mesh
    }

    /// An upright cylinder: radius and half height \[m\].
    pub fn cylinder(radius_m: f64, half_m: f64) -> Self {
        let mut mesh = Mesh::default();
        let around = |k: usize| sin_cos(TAU * k as f64 / AROUND as f64);
        for k in 0..AROUND {
            let first = mesh.vertices.len() as u32;
            for (sin, cos) in [around(k), around(k + 1)] {
                let normal = Vector3::new(cos, sin, 0.0);
                for z in [-half_m, half_m] {
                    let at = normal * radius_m + Vector3::z() * z;
                    mesh.vertices.push(Vertex { at: at.cast(), normal: normal.cast() });
                }
            }
            mesh.triangles.extend([[first, first + 2, first + 3], [first, first + 3, first + 1]]);
        }
        for side in [-1.0, 1.0] {
            let (first, normal) = (mesh.vertices.len() as u32, Vector3::z() * side);
            for k in 0..AROUND {
                // Counter-clockwise seen from outside.
                let (sin, cos) = around(if side > 0.0 { k } else { AROUND - k });
                let at = Vector3::new(cos * radius_m, sin * radius_m, side * half_m);
                mesh.vertices.push(Vertex { at: at.cast(), normal: normal.cast() });
            }
            mesh.triangles.extend((1..AROUND as u32 - 1).map(|k| [first, first + k, first + k + 1]));
        }
        mesh
    }

    /// A box along the axes: centre and half edges \[m\].
    pub fn cuboid(center_m: [f64; 3], half_m: [f64; 3]) -> Self {
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let normal = Vector3::ith(axis, side);
                // u x v points outwards, so that the corners below run counter-clockwise.
                let u = Vector3::ith((axis + 1) % 3, side);
                let v = Vector3::ith((axis + 2) % 3, 1.0);
                let corner =
                    |a: f64, b: f64| Vector3::from(center_m) + (normal + u * a + v * b).component_mul(&Vector3::from(half_m));
                let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                let first = mesh.vertices.len() as u32;
                mesh.vertices.extend(corners.map(|at| Vertex { at: at.cast(), normal: normal.cast() }));
                mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
        mesh
    }

    /// A segment with a radius \[m\]: rings of corners from the pole behind `from` to the pole beyond `to`.
    pub fn capsule(from: Vector3<f64>, to: Vector3<f64>, radius: f64, Detail { around, rings }: Detail) -> Self {
        let axis = to - from;
        // Any turn that brings z onto the axis will do; a half turn about x is the one for an axis along -z.
        let turn = Rotation3::rotation_between(&Vector3::z(), &axis)
            .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let mut mesh = Mesh::default();
        let rows = 2 * (rings + 1);
        for row in 0..rows {
            let far = row > rings;
            let step = if far { row - rings - 1 } else { row };
            let elevation = FRAC_PI_2 * (step as f64 / rings as f64 - if far { 0.0 } else { 1.0 });
            let (up, out) = sin_cos(elevation);
            for k in 0..around {
                let (sin, cos) = sin_cos(TAU * k as f64 / around as f64);
                let normal = turn * Vector3::new(out * cos, out * sin, up);
                let at = if far { to } else { from } + normal * radius;
                mesh.vertices.push(Vertex { at: at.cast(), normal: normal.cast() });
            }
        }
        for row in 0..rows - 1 {
            for k in 0..around {
                let index = |row: usize, k: usize| (row * around + k % around) as u32;
                let (a, b, c, d) = (index(row, k), index(row, k + 1), index(row + 1, k + 1), index(row + 1, k));
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }

    /// The twelve edges of a box as one mesh of thin bars: centre, half edges and half thickness \[m\].
    pub fn frame(center_m: [f64; 3], half_m: [f64; 3], half_bar_m: f64) -> Self {
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let (mut center, mut half) = (center_m, [half_bar_m; 3]);
                center[u] += a * half_m[u];
                center[v] += b * half_m[v];
                half[axis] = half_m[axis] + half_bar_m;
                mesh.append(&Mesh::cuboid(center, half));
            }
        }
        mesh
    }

    /// Adds the triangles of another mesh.
    pub fn append(&mut self, other: &Mesh) {
        let first = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
    }

    /// The vertices moved by `world_from_mesh`.
    pub fn placed(&self, world_from_mesh: &Isometry3<f64>) -> impl Iterator<Item = Vertex> {
        let iso: Isometry3<f32> = world_from_mesh.cast();
        self.vertices
            .iter()
            .map(move |v| Vertex { at: iso.rotation * v.at + iso.translation.vector, normal: iso.rotation * v.normal })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume by the divergence theorem: positive only if every triangle runs counter-clockwise seen from outside.
    fn volume(mesh: &Mesh) -> f32 {
        let at = |i: u32| mesh.vertices[i as usize].at;
        mesh.triangles.iter().map(|t| at(t[0]).dot(&at(t[1]).cross(&at(t[2]))) / 6.0).sum()
    }

    #[test]
    fn meshes_are_closed_and_face_outwards() {
        let box_volume = volume(&Mesh::cuboid([0.3, -0.2, 0.1], [0.1, 0.2, 0.3]));
        assert!((box_volume - 0.048).abs() < 1e-5, "{box_volume}");
        let exact = std::f32::consts::PI * 0.01 * (0.4 + 4.0 / 3.0 * 0.1);
        for to in [[0.0, 0.0, 0.4], [0.0, 0.0, -0.4], [0.4, 0.0, 0.0]] {
            let share = volume(&Mesh::capsule(Vector3::zeros(), to.into(), 0.1, Detail::FINE)) / exact;
            assert!((0.95..1.0).contains(&share), "{to:?}: {share} of the exact volume");
        }
    }
}
