//! Soft shadows on the table: everything flattened onto it along the light, then blurred.

use super::camera::Camera;
use super::mesh::Mesh;
use super::raster::{Area, Cover, Rgb, Samples, light};
use nalgebra::{Isometry3, Vector3};

/// How much of the table's brightness a full shadow takes.
const STRENGTH: f32 = 0.30;
/// Blur radius as a share of the picture's width.
const SOFTNESS: f32 = 0.007;

/// Smaller sums are rounding.
const LEAST: f32 = 1e-4;

/// How much of each pixel lies in shadow.
pub struct Mask {
    /// Where it may be more than 0.
    pub area: Area,
    /// 0..=1, row by row, of the whole picture.
    values: Vec<f32>,
    width: usize,
}

impl Mask {
    /// The shadow of `solids` on a picture of `width` x `height` pixels.
    pub fn new(camera: &Camera, width: usize, height: usize, solids: &[(&Mesh, Isometry3<f64>, Rgb)]) -> Self {
        let light = light();
        let (mut values, mut area) = (vec![0.0; width * height], Area::NONE);
        for (mesh, pose, _) in solids {
            let flat: Vec<_> = mesh.placed(pose).map(|v| flatten(camera, &v.at, &light)).collect();
            for triangle in &mesh.triangles {
                if let [Some(a), Some(b), Some(c)] = triangle.map(|i| flat[i as usize]) {
                    // What faces away from the light flattens to a back and casts the same shadow as the rest.
                    if let Some(cover) = Cover::new([a, b, c], width, height) {
                        area = area.join(cover.area);
                        cover.each(|i, _| values[i] = 1.0);
                    }
                }
            }
        }
        if area.is_empty() {
            return Mask { area, values, width };
        }
        let radius = (width as f32 * SOFTNESS).round() as usize;
        let area = area.grown(2 * radius, width, height);
        let mut scratch = vec![0.0; values.len()];
        for _ in 0..2 {
            blur(&values, &mut scratch, [area.columns, area.rows], [1, width], radius);
            blur(&scratch, &mut values, [area.rows, area.columns], [width, 1], radius);
        }
        Mask { area, values, width }
    }

    /// Darkens the samples with that tag, `zoom` x `zoom` of them a pixel.
    pub fn darken(&self, picture: &mut Samples, zoom: usize, tag: u8) {
        if self.area.is_empty() {
            return;
        }
        for y in self.area.rows[0]..self.area.rows[1] {
            for x in self.area.columns[0]..self.area.columns[1] {
                let light = 1.0 - STRENGTH * self.values[y * self.width + x];
                let cells = (0..zoom * zoom).map(|k| (y * zoom + k / zoom) * picture.width + x * zoom + k % zoom);
                for at in cells.filter(|_| light < 1.0) {
                    let [r, g, b, drawn] = picture.color[at];
                    if drawn == tag {
                        let [r, g, b] = [r, g, b].map(|v| (f32::from(v) * light) as u8);
                        picture.color[at] = [r, g, b, tag];
                    }
                }
            }
        }
        let samples = |[first, end]: [usize; 2]| [first * zoom, end * zoom];
        let area = Area { columns: samples(self.area.columns), rows: samples(self.area.rows) };
        picture.drawn = picture.drawn.join(area);
    }
}

/// Picture point of the shadow that a point above the table casts on it.
fn flatten(camera: &Camera, at: &Vector3<f32>, light: &Vector3<f32>) -> Option<[f32; 2]> {
    let on_table = at - light * (at.z / light.z);
    camera.project(&on_table).map(|[x, y, _]| [x, y])
}

/// Running mean over `2 radius + 1` neighbours along one direction; `spans` (first and end) and `strides` are along and across it.
fn blur(from: &[f32], to: &mut [f32], spans: [[usize; 2]; 2], strides: [usize; 2], radius: usize) {
    let ([first, end], width) = (spans[0], (2 * radius + 1) as f32);
    for line in spans[1][0]..spans[1][1] {
        let at = |i: usize| line * strides[1] + i * strides[0];
        let mut sum: f32 = (first..(first + radius).min(end)).map(|i| from[at(i)]).sum();
        for i in first..end {
            if i + radius < end {
                sum += from[at(i + radius)];
            }
            if i > first + radius {
                sum -= from[at(i - radius - 1)];
            }
            // What rounding leaves over outside of the shadow is no shadow.
            to[at(i)] = if sum > LEAST { sum / width } else { 0.0 };
        }
    }
}
