//! A robot on its own: in its ready pose, with the hand open and closed.

use super::camera::Camera;
use super::links;
use super::mesh::Detail;
use super::raster::{Area, Samples};
use super::{RgbImage, SUPERSAMPLING, check_size, colors, draw_solids, font, resolve, table};
use crate::error::{Error, Result};
use crate::robot::Robot;

/// Writes a PNG with two pictures of `size` pixels side by side: the open and the closed hand.
///
/// # Errors
/// [`Error::Usage`] for an impossible size.
pub fn robot_png(robot: &Robot, size: (u32, u32), out: &mut Vec<u8>) -> Result<()> {
    check_size("a picture", size)?;
    let mut closed = robot.ready;
    closed[robot.arm..].copy_from_slice(&robot.closed);
    let (width, height) = size;
    let mut both = RgbImage { width: 2 * width, height, data: vec![0; (2 * width * height * 3) as usize] };
    for (side, (q, words)) in [(&robot.ready, "ready"), (&closed, "closed")].into_iter().enumerate() {
        let mut picture = picture(robot, q, size);
        font::write(&mut picture, &format!("{}  {words}", robot.name), colors::TEXT);
        super::sheet::paste(&mut both, &picture, side as u32 * width, 0);
    }
    super::sheet::write_png(&both, out).map_err(|e| Error::Failed(format!("cannot write the picture: {e}")))
}

fn picture(robot: &Robot, q: &[f64], size: (u32, u32)) -> RgbImage {
    let (width, height) = (size.0 as usize, size.1 as usize);
    let (samples, pixels) = (Camera::new(width * SUPERSAMPLING, height * SUPERSAMPLING), Camera::new(width, height));
    let mut canvas: Samples = table(&samples, width * SUPERSAMPLING, height * SUPERSAMPLING);
    let poses = robot.link_poses(q);
    let meshes = links::of_robot(robot, Detail::FINE);
    let solids: Vec<_> = meshes.iter().map(|(link, mesh, local, rgb)| (mesh, poses[*link] * local, *rgb)).collect();
    draw_solids(&mut canvas, [&samples, &pixels], size, &solids);
    let mut picture = RgbImage { width: size.0, height: size.1, data: vec![0; width * height * 3] };
    resolve(&canvas, Area::all(width, height), &mut picture);
    picture
}
