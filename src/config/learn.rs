//! Settings of learning.

use serde::{Deserialize, Serialize};

/// `[pretrain]`: the dynamics network, Algorithm 4.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PretrainSettings {}

/// `[train]`: the policy, Algorithms 1-3.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainSettings {}
