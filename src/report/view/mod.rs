//! Episodes as one HTML page to look at: a small viewer in WebGL 2 with all it shows inside, which asks nothing of the network.
//!
//! The viewer is the files under `page/`, put together as they are; what it shows is one JSON text, numbers in base64. The page computes the robots' links
//! from the joint positions by the same chain of joints as [`crate::robot::Robot::link_poses`].

mod atlas;
mod charts;
mod episode;
mod events;
mod ghost;
mod pack;
mod parts;
mod shown;

pub use atlas::{Atlas, Start};
pub use ghost::Ghost;
pub use shown::Shown;

use crate::error::Result;
use crate::report::chart::escaped;
use crate::report::render::{self, camera, raster};
use crate::state::CONTROL_DT_S;
use parts::Parts;
use serde_json::{Value, json};
use std::path::Path;

const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/style.css");
/// The viewer, in the order in which its files use each other.
const SCRIPT: [&str; 9] = [
    include_str!("page/math.js"),
    include_str!("page/episode.js"),
    include_str!("page/painter.js"),
    include_str!("page/camera.js"),
    include_str!("page/stage.js"),
    include_str!("page/timeline.js"),
    include_str!("page/charts.js"),
    include_str!("page/atlas.js"),
    include_str!("page/main.js"),
];

/// The page: the same bytes on every run.
///
/// # Errors
/// [`crate::error::Error::Failed`] when a picture of the atlas cannot be written.
pub fn page(title: &str, shown: &[Shown], atlas: Option<&Atlas>) -> Result<String> {
    let mut parts = Parts::default();
    let episodes = shown.iter().map(|shown| episode::content(shown, atlas.is_some(), &mut parts)).collect::<Result<Vec<_>>>()?;
    let table_mesh = parts.mesh(&parts::table());
    let data = json!({
        "title": title,
        "period_s": CONTROL_DT_S,
        "table_m": render::TABLE_M,
        "table_mesh": table_mesh,
        "light": raster::light().as_slice(),
        "look": { "eye_m": camera::EYE_M, "at_m": camera::LOOK_AT_M, "view_height": camera::VIEW_HEIGHT, "aspect": camera::ASPECT },
        "episodes": episodes,
        "atlas": atlas.map(|atlas| atlas.content(shown)),
        "meshes": parts.meshes,
        "robots": parts.robots,
    });
    Ok(filled(title, &data))
}

/// The page's text with everything in its place.
fn filled(title: &str, data: &Value) -> String {
    // Nothing in it ends the element that holds it.
    let data = data.to_string().replace('<', "\\u003c");
    let (title, script) = (escaped(title), SCRIPT.join("\n"));
    let mut page = String::with_capacity(PAGE.len() + STYLE.len() + script.len() + data.len());
    let mut rest = PAGE;
    for (name, content) in [("{{title}}", title.as_ref()), ("{{style}}", STYLE), ("{{data}}", &data), ("{{script}}", &script)] {
        let (before, after) = rest.split_once(name).expect("the page has each place once, in this order");
        page.extend([before, content]);
        rest = after;
    }
    page + rest
}

/// Names that tell files apart: `episode 3`, of several directories with the part of the path in which they differ.
pub fn names(files: &[&Path]) -> Vec<String> {
    let stem = |file: &Path| {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match stem.strip_prefix("episode-").and_then(|digits| digits.parse::<u64>().ok()) {
            Some(number) => format!("episode {number}"),
            None => stem,
        }
    };
    let parents: Vec<Vec<String>> = files
        .iter()
        .map(|file| {
            let parent = std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
            let names = parent.parent().into_iter().flat_map(Path::components);
            names.map(|part| part.as_os_str().to_string_lossy().into_owned()).collect()
        })
        .collect();
    let shared = |back: bool| {
        let part = |of: &[String], i: usize| if back { of.iter().rev().nth(i).cloned() } else { of.get(i).cloned() };
        (0..)
            .take_while(|i| part(&parents[0], *i).is_some() && parents.iter().all(|of| part(of, *i) == part(&parents[0], *i)))
            .count()
    };
    if files.is_empty() || parents.iter().all(|parent| *parent == parents[0]) {
        return files.iter().map(|file| stem(file)).collect();
    }
    let (first, last) = (shared(false), shared(true));
    let differing = |parent: &[String]| parent[first..(parent.len() - last).max(first)].join("/");
    files.iter().zip(&parents).map(|(file, parent)| format!("{} {}", differing(parent), stem(file)).trim().to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_one_directory_are_called_by_their_numbers_and_others_by_where_they_differ() {
        let of = |files: &[&str]| names(&files.iter().map(Path::new).collect::<Vec<_>>());
        assert_eq!(of(&["a/episode-00007.mcap", "a/mine.mcap"]), ["episode 7", "mine"]);
        assert_eq!(
            of(&["runs/bc/rollouts/episode-00007.mcap", "runs/hil/rollouts/episode-00007.mcap"]),
            ["bc episode 7", "hil episode 7"]
        );
        assert_eq!(of(&["a/episode-00001.mcap", "a/b/episode-00001.mcap"]), ["episode 1", "b episode 1"]);
    }

    #[test]
    fn what_is_shown_cannot_leave_its_element() {
        let page = filled("a < b", &json!({ "name": "</script><b>{{style}}" }));
        assert!(page.contains("<title>a &lt; b</title>") && !page.contains("</script><b>"), "{page}");
        assert!(page.contains(r#""\u003c/script>\u003cb>{{style}}""#));
        assert_eq!(page.matches("</script>").count(), 2);
    }
}
