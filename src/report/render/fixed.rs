//! What stands still in a scene: obstacles, and the marks of where objects are to be.

use super::mesh::Mesh;
use crate::scene::Scene;

/// Half thickness of the bars around the target \[m\].
const MARKER_HALF_BAR_M: f64 = 0.0012;
/// Room between a block that stands exactly on the target and the marker's faces \[m\].
const MARKER_ROOM_M: f64 = 0.003;
/// Opacity of the marker's faces.
pub const MARKER_OPACITY: f32 = 0.18;

/// What shows where objects are to be: bars along the edges, and faces between them to be seen through.
pub fn marker(scene: &Scene) -> [Mesh; 2] {
    let (mut bars, mut faces) = (Mesh::default(), Mesh::default());
    for (goal, of) in scene.task.goals.iter().enumerate() {
        let around = scene.task.objects[of.object].shape.half_m().map(|half| half + MARKER_ROOM_M);
        bars.append(&Mesh::frame(scene.target_m(goal), around, MARKER_HALF_BAR_M));
        faces.append(&Mesh::cuboid(scene.target_m(goal), around));
    }
    [bars, faces]
}

/// Boxes to keep clear of.
pub fn obstacles(scene: &Scene) -> impl Iterator<Item = Mesh> {
    scene.obstacles.iter().map(|o| Mesh::cuboid(o.center_m, o.size_m.map(|v| v / 2.0)))
}
