//! Soft shadows on the table: everything flattened onto it along the light, then blurred.

use super::camera::Camera;
use super::mesh::Mesh;
use super::raster::{Cover, Rgb, Samples, light};
use nalgebra::{Isometry3, Vector3};

/// How much of the table's brightness a full shadow takes.
const STRENGTH: f32 = 0.30;
/// Blur radius as a share of the picture's width.
const SOFTNESS: f32 = 0.007;

/// How much of each pixel lies in shadow, 0..=1, row by row.
pub fn mask(camera: &Camera, width: usize, height: usize, solids: &[(&Mesh, Isometry3<f64>, Rgb)]) -> Vec<f32> {
    let light = light();
    let mut mask = vec![0.0; width * height];
    for (mesh, pose, _) in solids {
        let flat: Vec<_> = mesh.placed(pose).map(|v| flatten(camera, &v.at, &light)).collect();
        for triangle in &mesh.triangles {
            if let [Some(a), Some(b), Some(c)] = triangle.map(|i| flat[i as usize]) {
                // What faces away from the light flattens to a back and casts the same shadow as the rest.
                if let Some(cover) = Cover::new([a, b, c], width, height) {
                    cover.each(|i, _| mask[i] = 1.0);
                }
            }
        }
    }
    let radius = (width as f32 * SOFTNESS).round() as usize;
    let mut scratch = vec![0.0; mask.len()];
    for _ in 0..2 {
        blur(&mask, &mut scratch, [width, height], [1, width], radius);
        blur(&scratch, &mut mask, [height, width], [width, 1], radius);
    }
    mask
}

/// Darkens the samples with that tag, `zoom` x `zoom` of them a pixel.
pub fn darken(picture: &mut Samples, mask: &[f32], zoom: usize, tag: u8) {
    let width = picture.width;
    for (y, row) in picture.color.chunks_exact_mut(width.max(1)).enumerate() {
        for (x, sample) in row.iter_mut().enumerate() {
            let shade = mask[y / zoom * (width / zoom) + x / zoom];
            if shade > 0.0 && sample[3] == tag {
                sample[..3].iter_mut().for_each(|v| *v = (f32::from(*v) * (1.0 - STRENGTH * shade)) as u8);
            }
        }
    }
}

/// Picture point of the shadow that a point above the table casts on it.
fn flatten(camera: &Camera, at: &Vector3<f32>, light: &Vector3<f32>) -> Option<[f32; 2]> {
    let on_table = at - light * (at.z / light.z);
    camera.project(&on_table).map(|[x, y, _]| [x, y])
}

/// Running mean over `2 radius + 1` neighbours along one direction; `counts` and `strides` are along and across it.
fn blur(from: &[f32], to: &mut [f32], counts: [usize; 2], strides: [usize; 2], radius: usize) {
    let (length, width) = (counts[0], (2 * radius + 1) as f32);
    for line in 0..counts[1] {
        let at = |i: usize| line * strides[1] + i * strides[0];
        // Counting in whole steps of the first blur keeps flat parts exactly flat; later rounding is far below a grey level.
        let mut sum: f32 = (0..radius.min(length)).map(|i| from[at(i)]).sum();
        for i in 0..length {
            if i + radius < length {
                sum += from[at(i + radius)];
            }
            if i > radius {
                sum -= from[at(i - radius - 1)];
            }
            to[at(i)] = if sum > 1e-4 { sum / width } else { 0.0 };
        }
    }
}
