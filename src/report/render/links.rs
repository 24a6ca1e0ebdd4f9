//! The links of a robot as they are drawn.

use super::colors;
use super::mesh::{Detail, Mesh};
use super::raster::Rgb;
use crate::robot::Robot;
use crate::robot::model::Link;
use nalgebra::Isometry3;

/// What is drawn of a robot: link, mesh, where it is in the link's frame, colour.
pub fn of_robot(robot: &Robot, detail: Detail) -> Vec<(usize, Mesh, Isometry3<f64>, Rgb)> {
    let of_link = move |(link, shapes): (usize, &Link)| {
        let rgb = colors::of_link(link, robot.arm);
        let drawn = shapes.shapes.iter().map(|shape| Mesh::of_shape(shape, detail));
        drawn.map(move |(mesh, local)| (link, mesh, local, rgb)).collect::<Vec<_>>()
    };
    robot.links.iter().enumerate().flat_map(of_link).collect()
}
