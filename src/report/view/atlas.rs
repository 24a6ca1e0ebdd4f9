//! The failure atlas: how all episodes of an evaluation end, where they start, and pictures of some.

use super::pack;
use super::shown::{Shown, class_words};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::report::render::{frame, write_png};
use crate::task::{FailureClass, Task};
use serde_json::{Value, json};
use std::sync::Arc;

/// Size of a picture \[pixels\].
const PICTURE_PX: (u32, u32) = (240, 180);
/// What moves less over all episodes stands where it stands \[m\]: it needs no map.
const SAME_PLACE_M: f64 = 1e-6;

/// Where an episode started, and how it ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Its number.
    pub index: u64,
    /// Why it failed; `None` if it did not.
    pub failure: Option<FailureClass>,
    /// x y of each object, then of each goal on the table \[m\].
    pub places_m: Vec<[f64; 2]>,
}

impl Start {
    /// What is kept of an episode.
    pub fn of(episode: &Episode) -> Self {
        let scene = &episode.scene;
        let objects = scene.objects.iter().map(|object| object.pose.position_m);
        let places_m = objects.chain(scene.goals.iter().copied()).map(|[x, y, _]| [x, y]).collect();
        Start { index: episode.index, failure: episode.failure, places_m }
    }
}

/// All episodes.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// Their task.
    pub task: Arc<Task>,
    /// Each of them.
    pub starts: Vec<Start>,
}

impl Atlas {
    /// The first `most` episodes of each way to end, in order: by their places in the list.
    pub fn chosen(&self, most: usize) -> Vec<usize> {
        let of = |class: &Option<FailureClass>| {
            let found = self.starts.iter().enumerate().filter(|(_, start)| start.failure == *class);
            found.map(|(i, _)| i).take(most).collect::<Vec<_>>()
        };
        // Failures first: they are what one comes for.
        let classes = classes();
        let (success, failures) = classes.split_first().expect("success is a class");
        failures.iter().chain([success]).flat_map(of).collect()
    }

    /// As the page holds it; `shown` are the episodes on it.
    pub(super) fn content(&self, shown: &[Shown]) -> Value {
        let there: Vec<Option<FailureClass>> =
            classes().into_iter().filter(|class| class.is_none() || self.starts.iter().any(|s| s.failure == *class)).collect();
        let outcome = |start: &Start| there.iter().position(|class| *class == start.failure);
        let on_page = |start: &Start| shown.iter().position(|shown| shown.episode.index == start.index);
        let told: Vec<Value> = there
            .iter()
            .map(|class| {
                let (name, words) = class_words(*class);
                let count = self.starts.iter().filter(|start| start.failure == *class).count();
                json!({ "name": name, "words": words, "count": count })
            })
            .collect();
        json!({
            "classes": told,
            "outcomes": self.starts.iter().map(outcome).collect::<Vec<_>>(),
            "numbers": self.starts.iter().map(|start| start.index).collect::<Vec<_>>(),
            "shown": self.starts.iter().map(on_page).collect::<Vec<_>>(),
            "maps": self.maps(),
        })
    }

    /// A map for everything that does not always start in the same place; of the first object in any case.
    fn maps(&self) -> Vec<Value> {
        let names = self.task.objects.iter().map(|object| object.name.clone()).chain(self.task.goal_names());
        let varies = |k: usize| {
            let first = self.starts[0].places_m[k];
            self.starts.iter().any(|s| (0..2).any(|axis| (s.places_m[k][axis] - first[axis]).abs() > SAME_PLACE_M))
        };
        let of = |(k, name): (usize, String)| {
            let at: Vec<[f64; 2]> = self.starts.iter().map(|start| start.places_m[k].map(rounded)).collect();
            json!({ "name": name, "at": at })
        };
        names.enumerate().filter(|(k, _)| *k == 0 || varies(*k)).map(of).collect()
    }
}

/// Success, then the failures in the order of tables.
fn classes() -> Vec<Option<FailureClass>> {
    [None].into_iter().chain(FailureClass::ALL.map(Some)).collect()
}

/// To a tenth of a millimetre, as short as that.
fn rounded(v: f64) -> f64 {
    (v * 1e4).round() / 1e4
}

/// The end of an episode as a picture within the page.
pub(super) fn picture(episode: &Episode) -> Result<String> {
    let mut png = Vec::new();
    write_png(&frame(episode, episode.steps.len(), PICTURE_PX), &mut png)
        .map_err(|e| Error::Failed(format!("cannot write a picture of episode {}: {e}", episode.index)))?;
    Ok(format!("data:image/png;base64,{}", pack::bytes(&png)))
}
