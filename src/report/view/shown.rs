//! What a page shows, and words for it.

use super::ghost::Ghost;
use crate::demo::Episode;
use crate::task::FailureClass;

/// An episode that the page shows.
#[derive(Clone, Debug)]
pub struct Shown {
    /// What it is called, short.
    pub name: String,
    /// Who acted, or what else tells it from the others.
    pub about: String,
    /// What happened.
    pub episode: Episode,
    /// What the dynamics network expected.
    pub ghost: Option<Ghost>,
}

/// How it ended, in words.
pub(super) fn ending(episode: &Episode) -> String {
    match episode.failure {
        _ if episode.success => "success".into(),
        Some(class) => class.name().replace('_', " "),
        None => "failed".into(),
    }
}

/// What a class of endings is called, and what it means.
pub(super) fn class_words(failure: Option<FailureClass>) -> (String, &'static str) {
    failure.map_or(("success".into(), "the task was solved"), |class| (class.name().replace('_', " "), class.words()))
}
