//! An episode as the page holds it.

use super::parts::{Parts, rows};
use super::shown::{Shown, ending};
use super::{atlas, charts, events};
use crate::demo::Step;
use crate::error::Result;
use crate::report::render::colors;
use crate::report::render::fixed::{MARKER_OPACITY, marker, obstacles};
use crate::report::render::mesh::Mesh;
use crate::scene::Scene;
use serde_json::{Value, json};

/// All that the page needs of it; `picture` adds one of its end.
pub(super) fn content(shown: &Shown, picture: bool, parts: &mut Parts) -> Result<Value> {
    let Shown { name, about, episode, ghost } = shown;
    let (scene, task) = (&episode.scene, &episode.scene.task);
    let objects: Vec<Value> = (task.objects.iter().enumerate())
        .map(|(i, object)| {
            let mesh = parts.mesh(&Mesh::of_object(&object.shape));
            json!({ "name": object.name, "mesh": mesh, "rgb": colors::of_object(task, i), "moved": i < task.moved() })
        })
        .collect();
    let ghost_rows = ghost
        .as_ref()
        .map(|ghost| json!({ "ahead": ghost.ahead, "rows": rows(ghost.rows.iter().map(|row| row.iter().copied())) }));
    Ok(json!({
        "name": name,
        "about": about,
        "ending": ending(episode),
        "success": episode.success,
        "steps": episode.steps.len(),
        "robot": parts.robot(&scene.robot),
        "objects": objects,
        "fixed": fixed(scene, parts),
        "rows": rows(episode.moments().map(row)),
        "ghost": ghost_rows,
        "phases": events::phases(episode),
        "touches": events::touches(episode),
        "milestones": events::milestones(episode),
        "charts": charts::all(episode, ghost.as_ref()),
        "picture": if picture { Some(atlas::picture(episode)?) } else { None },
    }))
}

/// Positions of the joints, then a pose of each object.
fn row(step: &Step) -> impl Iterator<Item = f64> {
    step.state.q.iter().copied().chain(step.objects.iter().flat_map(|object| object.pose.to_array()))
}

/// What stands still: obstacles, and the marks of where objects are to be.
fn fixed(scene: &Scene, parts: &mut Parts) -> Vec<Value> {
    let mut all: Vec<Value> = obstacles(scene)
        .map(|mesh| json!({ "mesh": parts.mesh(&mesh), "rgb": colors::OBSTACLE, "alpha": 1.0, "casts": true }))
        .collect();
    let [bars, faces] = marker(scene);
    for (mesh, alpha) in [(bars, 1.0), (faces, MARKER_OPACITY)] {
        all.push(json!({ "mesh": parts.mesh(&mesh), "rgb": colors::TARGET, "alpha": alpha, "casts": false }));
    }
    all
}
