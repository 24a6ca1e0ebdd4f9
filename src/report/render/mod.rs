//! Pictures of episodes by a small software rasteriser: the same bytes on every run, no GPU, no window.

pub(in crate::report) mod camera;
pub(in crate::report) mod colors;
pub(in crate::report) mod fixed;
mod font;
mod gif;
pub(in crate::report) mod links;
pub(in crate::report) mod mesh;
pub(in crate::report) mod raster;
mod robot;
mod shadow;
mod sheet;

pub use self::gif::{GifOptions, write_gif};
pub use self::robot::robot_png;
pub(in crate::report) use sheet::write_png;
pub use sheet::write_png_sheet;

use crate::data::peek::PICTURE_MARK;
use crate::demo::{Body, Episode, Step};
use crate::error::{Error, Result};
use crate::robot::Robot;
use crate::scene::Scene;
use camera::Camera;
use fixed::{MARKER_OPACITY, marker, obstacles};
use mesh::{Detail, Mesh};
use nalgebra::{Isometry3, Translation3};
use raster::{Area, Paint, Rgb, Samples};
use std::sync::Arc;

/// Samples along each edge of a pixel: 2 x 2 of them make its colour.
const SUPERSAMPLING: usize = 2;
/// The table's edges: x low and high, y low and high \[m\]. Wide enough for every default spawn area and the arm's foot.
pub(in crate::report) const TABLE_M: [[f64; 2]; 2] = [[-0.14, 0.72], [-0.30, 0.40]];
/// Thickness of the table \[m\].
pub(in crate::report) const TABLE_THICKNESS_M: f64 = 0.03;
/// The table's upper layer, which takes shadows \[m\].
const TOP_LAYER_M: f64 = 0.001;
/// Tag of the samples that take shadows.
const TAG_TABLE: u8 = 1;
/// Smallest and largest picture edge that writers accept \[pixels\].
const EDGE_PX: [u32; 2] = [16, 4096];

/// What a picture says of who drew it: such a one may be replaced by another, somebody's own not.
fn mark() -> String {
    format!("{PICTURE_MARK}{}", env!("CARGO_PKG_VERSION"))
}

/// A picture, three bytes (red, green, blue) a pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height * 3` bytes.
    pub data: Vec<u8>,
}

/// The picture of s_t for `step` = t (0-based; T and beyond give the last state), `size` = width and height \[pixels\].
pub fn frame(episode: &Episode, step: usize, size: (u32, u32)) -> RgbImage {
    Renderer::new(&episode.scene, size).draw(step_at(episode, step))
}

fn step_at(episode: &Episode, step: usize) -> &Step {
    episode.steps.get(step).unwrap_or(&episode.last)
}

fn check_size(what: &str, (width, height): (u32, u32)) -> Result<()> {
    let allowed = EDGE_PX[0]..=EDGE_PX[1];
    if allowed.contains(&width) && allowed.contains(&height) {
        return Ok(());
    }
    let [low, high] = EDGE_PX;
    Err(Error::Usage(format!(
        "{what} of {width} x {height} pixels: each edge must be {low} to {high} pixels; choose another size"
    )))
}

/// Time, then the demonstrator's phase or, at the end, how it went.
fn label(episode: &Episode, step: usize) -> (String, Rgb) {
    let time_s = step.min(episode.steps.len()) as f64 * crate::state::CONTROL_DT_S;
    let (note, color) = match (step < episode.steps.len(), episode.success, episode.failure) {
        (true, _, _) => (episode.steps[step].phase.map_or("", |p| p.name()), colors::TEXT),
        (false, true, _) => ("success", colors::GOOD),
        (false, false, failure) => (failure.map_or("failed", |f| f.name()), colors::BAD),
    };
    (format!("t {time_s:.2} s  {note}").trim_end().to_string(), color)
}

/// What is drawn in each picture of one episode, prepared once.
struct Renderer {
    size: (u32, u32),
    samples: Camera,
    pixels: Camera,
    /// The table, before anything stands on it: samples and pixels.
    empty: (Samples, RgbImage),
    /// What is being drawn; shows the empty table between two pictures.
    canvas: Samples,
    robot: Arc<Robot>,
    links: Vec<(usize, Mesh, Isometry3<f64>, Rgb)>,
    /// Of each object of the task.
    objects: Vec<(Mesh, Rgb)>,
    obstacles: Vec<Mesh>,
    marker_bars: Mesh,
    marker_faces: Mesh,
}

impl Renderer {
    fn new(scene: &Scene, size: (u32, u32)) -> Self {
        let (width, height) = (size.0 as usize, size.1 as usize);
        let samples = Camera::new(width * SUPERSAMPLING, height * SUPERSAMPLING);
        let canvas = table(&samples, width * SUPERSAMPLING, height * SUPERSAMPLING);
        let mut plain = RgbImage { width: size.0, height: size.1, data: vec![0; width * height * 3] };
        resolve(&canvas, Area::all(width, height), &mut plain);
        let task = &scene.task;
        let objects =
            task.objects.iter().enumerate().map(|(i, object)| (Mesh::of_object(&object.shape), colors::of_object(task, i)));
        let [marker_bars, marker_faces] = marker(scene);
        Renderer {
            size,
            pixels: Camera::new(width, height),
            empty: (canvas.clone(), plain),
            canvas,
            samples,
            robot: Arc::clone(&scene.robot),
            links: links::of_robot(&scene.robot, Detail::FINE),
            objects: objects.collect(),
            obstacles: obstacles(scene).collect(),
            marker_bars,
            marker_faces,
        }
    }

    fn draw(&mut self, step: &Step) -> RgbImage {
        let mut canvas = std::mem::replace(&mut self.canvas, Samples::new(0, 0, colors::BACKGROUND));
        let solids = self.solids(&step.state.q, &step.objects);
        draw_solids(&mut canvas, [&self.samples, &self.pixels], self.size, &solids);
        let marker = |opacity| Paint { rgb: colors::TARGET, opacity, tag: 0 };
        canvas.draw(&self.samples, &self.marker_bars, &Isometry3::identity(), marker(1.0));
        canvas.draw(&self.samples, &self.marker_faces, &Isometry3::identity(), marker(MARKER_OPACITY));
        let mut picture = self.empty.1.clone();
        resolve(&canvas, canvas.drawn.coarse(SUPERSAMPLING), &mut picture);
        canvas.restore(&self.empty.0);
        self.canvas = canvas;
        picture
    }

    /// Everything that casts a shadow: mesh, where it is, colour.
    fn solids(&self, q: &[f64], objects: &[Body]) -> Vec<(&Mesh, Isometry3<f64>, Rgb)> {
        let poses = self.robot.link_poses(q);
        let mut solids: Vec<_> = self.links.iter().map(|(link, mesh, local, rgb)| (mesh, poses[*link] * local, *rgb)).collect();
        solids.extend(self.objects.iter().zip(objects).map(|((mesh, rgb), now)| (mesh, now.pose.isometry(), *rgb)));
        solids.extend(self.obstacles.iter().map(|mesh| (mesh, Isometry3::identity(), colors::OBSTACLE)));
        solids
    }
}

/// Draws what stands on the table, with its shadows: mesh, where it is, colour. The cameras are those of samples and pixels.
fn draw_solids(
    canvas: &mut Samples,
    [samples, pixels]: [&Camera; 2],
    (width, height): (u32, u32),
    solids: &[(&Mesh, Isometry3<f64>, Rgb)],
) {
    let mask = shadow::Mask::new(pixels, width as usize, height as usize, solids);
    mask.darken(canvas, SUPERSAMPLING, TAG_TABLE);
    for (mesh, pose, rgb) in solids {
        canvas.draw(samples, mesh, pose, Paint { rgb: *rgb, opacity: 1.0, tag: 0 });
    }
}

/// Sets the pixels of `area` to the mean of their samples.
fn resolve(samples: &Samples, area: Area, picture: &mut RgbImage) {
    const COUNT: u16 = (SUPERSAMPLING * SUPERSAMPLING) as u16;
    for y in area.rows[0]..area.rows[1] {
        let rows: [&[[u8; 4]]; SUPERSAMPLING] =
            std::array::from_fn(|i| &samples.color[(y * SUPERSAMPLING + i) * samples.width..][..samples.width]);
        for x in area.columns[0]..area.columns[1] {
            let mut sum = [COUNT / 2; 3];
            for cell in rows.iter().flat_map(|r| &r[x * SUPERSAMPLING..(x + 1) * SUPERSAMPLING]) {
                (0..3).for_each(|i| sum[i] += u16::from(cell[i]));
            }
            let at = (y * picture.width as usize + x) * 3;
            picture.data[at..at + 3].copy_from_slice(&sum.map(|v| (v / COUNT) as u8));
        }
    }
}

/// Background and table.
fn table(camera: &Camera, width: usize, height: usize) -> Samples {
    let mut samples = Samples::new(width, height, colors::BACKGROUND);
    let middle = |[low, high]: [f64; 2]| (low + high) / 2.0;
    let half = |[low, high]: [f64; 2]| (high - low) / 2.0;
    let mut layer = |top_m: f64, bottom_m: f64, tag: u8| {
        let center = [middle(TABLE_M[0]), middle(TABLE_M[1]), (top_m + bottom_m) / 2.0];
        let mesh = Mesh::cuboid(center, [half(TABLE_M[0]), half(TABLE_M[1]), (top_m - bottom_m) / 2.0]);
        samples.draw(camera, &mesh, &Translation3::identity().into(), Paint { rgb: colors::TABLE, opacity: 1.0, tag });
    };
    layer(0.0, -TOP_LAYER_M, TAG_TABLE);
    layer(-TOP_LAYER_M, -TABLE_THICKNESS_M, 0);
    samples.drawn = Area::NONE;
    samples
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Contacts;
    use crate::robot::file::built_in::paper_robot;
    use crate::scene::Placed;
    use crate::state::Pose;
    use crate::task::built_in::stack;
    use nalgebra::Vector3;

    fn still(block: Pose, base: Pose) -> (Scene, Step) {
        let placed = |pose| Placed { pose, friction: 1.0, mass_kg: 0.1 };
        let objects = vec![placed(block), placed(base)];
        let scene =
            Scene { robot: paper_robot(), task: stack(), objects, goals: vec![], obstacles: vec![], finger_friction: 1.0 };
        let step = Step {
            state: scene.start(),
            objects: scene.objects.iter().map(|o| Body { pose: o.pose, speed_m_s: 0.0 }).collect(),
            commanded: [0.0; 9].into(),
            executed: [0.0; 9].into(),
            contacts: Contacts::none(3, 2),
            reward: 0.0,
            conditions: Vec::new(),
            phase: None,
        };
        (scene, step)
    }

    #[test]
    fn blocks_show_their_colour_where_their_centres_project() {
        let base = Pose::from_yaw([0.45, 0.27, 0.025], 0.0);
        for (x, y) in [(0.40, -0.10), (0.50, 0.0), (0.60, 0.12)] {
            let (scene, mut step) = still(Pose::from_yaw([x, y, 0.025], 0.4), base);
            step.objects[1].pose = Pose::from_yaw([0.36, 0.30, 0.025], 0.2);
            let picture = Renderer::new(&scene, (480, 360)).draw(&step);
            for (pose, rgb) in [(step.objects[0].pose, colors::MOVED[0]), (step.objects[1].pose, colors::BASE)] {
                let at = Vector3::from(pose.position_m).cast();
                let [column, row, _] = Camera::new(480, 360).project(&at).expect("before the camera");
                let start = (row as usize * 480 + column as usize) * 3;
                let seen = Vector3::from_fn(|i, _| f32::from(picture.data[start + i]));
                let turn = seen.angle(&Vector3::from(rgb.map(f32::from)));
                assert!(turn < 0.05, "{seen} instead of a shade of {rgb:?} at {pose:?}");
            }
        }
    }

    #[test]
    fn a_picture_does_not_depend_on_the_one_before() {
        let (scene, step) = still(Pose::from_yaw([0.5, 0.0, 0.025], 0.0), Pose::from_yaw([0.45, 0.27, 0.025], 0.0));
        let mut other = step.clone();
        other.state.q = paper_robot().ready.map(|v| v + 0.3);
        let mut renderer = Renderer::new(&scene, (160, 120));
        let first = renderer.draw(&step);
        assert_ne!(renderer.draw(&other), first);
        assert_eq!(renderer.draw(&step), first);
    }

    #[test]
    fn numbers_that_are_no_place_draw_nothing() {
        let (scene, mut step) = still(Pose::from_yaw([0.5, 0.0, 0.025], 0.0), Pose::from_yaw([0.45, 0.27, 0.025], 0.0));
        for wrong in [f64::NAN, f64::INFINITY, 1e30, -1e30] {
            step.objects[0].pose.position_m = [wrong; 3];
            step.state.q = [wrong; 9].into();
            let (width, height) = (64, 48);
            assert_eq!(Renderer::new(&scene, (width, height)).draw(&step).data.len(), (width * height * 3) as usize);
        }
        assert!(Renderer::new(&scene, (0, 0)).draw(&step).data.is_empty());
    }
}
