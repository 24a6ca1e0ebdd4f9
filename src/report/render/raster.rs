//! Triangles to samples: coverage, depth test, shading.

use super::camera::Camera;
use super::mesh::{Mesh, Vertex};
use nalgebra::{Isometry3, Vector3};

/// Direction towards the light (normalised when used): above, from the camera's side, so that shadows fall behind things.
const LIGHT: [f32; 3] = [0.35, -0.40, 0.95];
/// Brightness of a surface in full shade that looks sideways.
const AMBIENT: f32 = 0.56;
/// How much brighter (darker) it is looking straight up (down), as under an open sky.
const SKY: f32 = 0.10;
/// Brightness that direct light adds to a surface that faces it.
const DIRECT: f32 = 0.42;

/// Red, green, blue, 0..=255.
pub type Rgb = [u8; 3];

/// Unit vector towards the light.
pub fn light() -> Vector3<f32> {
    Vector3::from(LIGHT).normalize()
}

/// A rectangle of samples or pixels: first and end column, first and end row. Empty when the first is not before the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// First and end.
    pub columns: [usize; 2],
    /// First and end.
    pub rows: [usize; 2],
}

impl Area {
    /// Nothing: joining it changes nothing.
    pub const NONE: Area = Area { columns: [usize::MAX, 0], rows: [usize::MAX, 0] };

    /// All of a picture.
    pub fn all(width: usize, height: usize) -> Self {
        Area { columns: [0, width], rows: [0, height] }
    }

    /// The smallest rectangle around both.
    pub fn join(self, other: Area) -> Self {
        let around = |a: [usize; 2], b: [usize; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Area { columns: around(self.columns, other.columns), rows: around(self.rows, other.rows) }
    }

    /// Wider by `margin` on each side, within a picture.
    pub fn grown(self, margin: usize, width: usize, height: usize) -> Self {
        let wider = |[first, end]: [usize; 2], most: usize| [first.saturating_sub(margin), (end + margin).min(most)];
        Area { columns: wider(self.columns, width), rows: wider(self.rows, height) }
    }

    /// The cells of `zoom` x `zoom` that hold it.
    pub fn coarse(self, zoom: usize) -> Self {
        let cells = |[first, end]: [usize; 2]| [first / zoom, end.div_ceil(zoom)];
        Area { columns: cells(self.columns), rows: cells(self.rows) }
    }

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        self.columns[0] >= self.columns[1] || self.rows[0] >= self.rows[1]
    }
}

/// Samples of a picture with depth.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Samples in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Colours, and a tag that says what was drawn there.
    pub color: Vec<[u8; 4]>,
    /// Inverse distance to the camera \[1/m\]; 0 is infinitely far.
    depth: Vec<f32>,
    /// Where something was drawn since the last [`Samples::restore`].
    pub drawn: Area,
}

/// How a mesh is painted.
#[derive(Clone, Copy, Debug)]
pub struct Paint {
    /// Colour at brightness 1.
    pub rgb: Rgb,
    /// 0..=1: how much of what lies behind is covered.
    pub opacity: f32,
    /// Stored with every covered sample.
    pub tag: u8,
}

impl Samples {
    /// An empty picture.
    pub fn new(width: usize, height: usize, fill: Rgb) -> Self {
        let [r, g, b] = fill;
        let count = width * height;
        Samples { width, height, color: vec![[r, g, b, 0]; count], depth: vec![0.0; count], drawn: Area::NONE }
    }

    /// Puts back what `before` shows wherever something was drawn; both are of one size.
    pub fn restore(&mut self, before: &Samples) {
        let [first, end] = self.drawn.columns;
        if !self.drawn.is_empty() {
            for y in self.drawn.rows[0]..self.drawn.rows[1] {
                let row = y * self.width + first..y * self.width + end;
                self.color[row.clone()].copy_from_slice(&before.color[row.clone()]);
                self.depth[row.clone()].copy_from_slice(&before.depth[row]);
            }
        }
        self.drawn = Area::NONE;
    }

    /// Draws the front of a closed mesh: Lambert shading at the corners, blended between them.
    pub fn draw(&mut self, camera: &Camera, mesh: &Mesh, world_from_mesh: &Isometry3<f64>, paint: Paint) {
        let light = light();
        let corners: Vec<Option<Corner>> = mesh.placed(world_from_mesh).map(|v| corner(camera, &v, &light, paint.rgb)).collect();
        for triangle in &mesh.triangles {
            if let [Some(a), Some(b), Some(c)] = triangle.map(|i| corners[i as usize]) {
                self.fill(&a, &b, &c, paint);
            }
        }
    }

    fn fill(&mut self, a: &Corner, b: &Corner, c: &Corner, paint: Paint) {
        let Some(cover) = Cover::new([a.at, b.at, c.at], self.width, self.height) else { return };
        self.drawn = self.drawn.join(cover.area);
        cover.each(|index, [wa, wb, wc]| {
            let depth = wa * a.depth + wb * b.depth + wc * c.depth;
            if depth <= self.depth[index] {
                return;
            }
            self.depth[index] = depth;
            let mut new: [f32; 3] = std::array::from_fn(|i| wa * a.rgb[i] + wb * b.rgb[i] + wc * c.rgb[i]);
            if paint.opacity < 1.0 {
                let old = self.color[index];
                (0..3).for_each(|i| new[i] = f32::from(old[i]) + (new[i] - f32::from(old[i])) * paint.opacity);
            }
            let [r, g, b] = new.map(|v| (v + 0.5) as u8);
            self.color[index] = [r, g, b, paint.tag];
        });
    }
}

#[derive(Clone, Copy)]
struct Corner {
    at: [f32; 2],
    depth: f32,
    rgb: [f32; 3],
}

fn corner(camera: &Camera, vertex: &Vertex, light: &Vector3<f32>, rgb: Rgb) -> Option<Corner> {
    let [x, y, depth] = camera.project(&vertex.at)?;
    let brightness = AMBIENT + SKY * vertex.normal.z + DIRECT * vertex.normal.dot(light).max(0.0);
    Some(Corner { at: [x, y], depth, rgb: rgb.map(|v| (f32::from(v) * brightness).min(255.0)) })
}

/// The samples that a triangle covers, with their barycentric weights.
pub struct Cover {
    /// Where they are.
    pub area: Area,
    stride: usize,
    /// Weight of each corner: constant, change per column, change per row.
    weights: [[f32; 3]; 3],
}

impl Cover {
    /// `None` for a triangle that shows its back (clockwise on the picture), has no area or lies outside.
    pub fn new(corners: [[f32; 2]; 3], width: usize, height: usize) -> Option<Self> {
        let [a, b, c] = corners;
        // Rows grow downwards: what is counter-clockwise seen from outside has a negative area here.
        let doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if doubled >= 0.0 {
            return None;
        }
        let span = |i: usize, end: usize| {
            let low = a[i].min(b[i]).min(c[i]) - 0.5;
            let high = a[i].max(b[i]).max(c[i]) - 0.5;
            [low.ceil().max(0.0) as usize, ((high.floor() + 1.0).max(0.0) as usize).min(end)]
        };
        let area = Area { columns: span(0, width), rows: span(1, height) };
        if area.is_empty() {
            return None;
        }
        let edge = |p: [f32; 2], q: [f32; 2]| {
            let (dx, dy) = ((p[1] - q[1]) / doubled, (q[0] - p[0]) / doubled);
            // Samples lie in the middle of their cell.
            [(0.5 - p[0]) * dx + (0.5 - p[1]) * dy, dx, dy]
        };
        Some(Cover { area, stride: width, weights: [edge(b, c), edge(c, a), edge(a, b)] })
    }

    /// Calls `visit` with the index and the weights of each covered sample.
    pub fn each(&self, mut visit: impl FnMut(usize, [f32; 3])) {
        for y in self.area.rows[0]..self.area.rows[1] {
            let start = self.weights.map(|[w, _, dy]| w + dy * y as f32);
            let [mut first, mut end] = self.area.columns;
            // Narrow the row to where all three weights can be positive; the test below decides at its ends.
            for (w, [_, dx, _]) in start.iter().zip(&self.weights) {
                let root = -w / dx;
                if *dx > 0.0 {
                    first = first.max(root.max(0.0) as usize);
                } else if *dx < 0.0 {
                    end = end.min((root.max(0.0) as usize).saturating_add(2));
                }
            }
            for x in first..end {
                let mut w = start;
                (0..3).for_each(|i| w[i] += self.weights[i][1] * x as f32);
                if w[0] >= 0.0 && w[1] >= 0.0 && w[2] >= 0.0 {
                    visit(y * self.stride + x, w);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_covers_its_half_of_a_square_once() {
        let (lower, upper) = ([[0.0, 0.0], [0.0, 10.0], [10.0, 10.0]], [[0.0, 0.0], [10.0, 10.0], [10.0, 0.0]]);
        let mut hits = [0_u32; 100];
        for corners in [lower, upper] {
            Cover::new(corners, 10, 10).expect("faces the camera").each(|i, w| {
                assert!((w.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                hits[i] += 1;
            });
        }
        assert!(hits.iter().all(|h| *h >= 1), "no gap between neighbours");
        assert!(Cover::new([lower[0], lower[2], lower[1]], 10, 10).is_none(), "backs are not drawn");
        assert!(Cover::new(lower.map(|[x, y]| [x + 20.0, y]), 10, 10).is_none(), "outside of the picture");
    }
}
