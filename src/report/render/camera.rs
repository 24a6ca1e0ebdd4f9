//! A fixed perspective camera.

use nalgebra::Vector3;

/// Where the camera stands \[m\]: in front of the table, to the arm's right, so that neither hand nor arm hides the block.
pub const EYE_M: [f32; 3] = [1.38, -1.10, 0.86];
/// What it looks at \[m\].
pub const LOOK_AT_M: [f32; 3] = [0.27, 0.04, 0.255];
/// Height of the view at unit distance, for pictures that are at least 4:3 wide (a vertical angle of 33 degrees).
pub const VIEW_HEIGHT: f32 = 0.585;
/// Aspect the view is made for; a narrower picture shows the same width.
pub const ASPECT: f32 = 4.0 / 3.0;
/// Points nearer than this are not drawn \[m\].
const NEAREST_M: f32 = 0.05;

/// From world points to picture points.
#[derive(Clone, Debug)]
pub struct Camera {
    right: Vector3<f32>,
    up: Vector3<f32>,
    forward: Vector3<f32>,
    scale: f32,
    center: [f32; 2],
}

impl Camera {
    /// A camera for a picture of that many pixels.
    pub fn new(width: usize, height: usize) -> Self {
        let forward = (Vector3::from(LOOK_AT_M) - Vector3::from(EYE_M)).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        let (width, height) = (width as f32, height as f32);
        let scale = height.min(width / ASPECT) / VIEW_HEIGHT;
        Camera { right, up: right.cross(&forward), forward, scale, center: [width / 2.0, height / 2.0] }
    }

    /// Column, row (pixels, row 0 on top) and inverse distance \[1/m\] of a world point \[m\]; `None` behind or at the camera.
    pub fn project(&self, point: &Vector3<f32>) -> Option<[f32; 3]> {
        let ray = point - Vector3::from(EYE_M);
        let depth = ray.dot(&self.forward);
        if depth < NEAREST_M {
            return None;
        }
        let zoom = self.scale / depth;
        Some([self.center[0] + ray.dot(&self.right) * zoom, self.center[1] - ray.dot(&self.up) * zoom, 1.0 / depth])
    }
}
