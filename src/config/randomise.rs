//! Settings of what the policy sees while it learns from demos.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[train.randomise]`: what the policy sees of the demos' states is off by normal numbers, drawn anew for every state of every update; the actions
/// that it learns there stay as they are. Where all demos come from one simulator, the angles of the fingers and the way in which what they hold leans
/// are tied to each other as no other hand ties them; a policy that cannot trust them to a hair does not lean on that.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RandomiseSettings {
    /// Standard deviation of the angles of the fingers \[rad, or what counts as one\].
    pub fingers_rad: f64,
    /// Standard deviation of the angle by which an object that may move is turned, about each axis \[rad\].
    pub objects_rad: f64,
}
