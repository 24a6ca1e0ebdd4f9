//! Problems of a dataset.

use crate::error::Result;
use std::path::Path;

/// What was found, each in words, once.
#[derive(Default)]
pub(super) struct Problems {
    pub(super) said: Vec<String>,
}

impl Problems {
    pub(super) fn say(&mut self, what: String) {
        if !self.said.contains(&what) {
            self.said.push(what);
        }
    }

    /// An error is a problem, named below the root.
    pub(super) fn take(&mut self, root: &Path, result: Result<()>) {
        if let Err(why) = result {
            let why = why.to_string();
            let short =
                why.strip_prefix(&format!("{}/", root.display())).or_else(|| why.strip_prefix(&format!("{}: ", root.display())));
            self.say(short.unwrap_or(&why).to_string());
        }
    }
}
