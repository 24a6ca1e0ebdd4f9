//! Which kind a goal is.

use super::goal::Kind;
use super::{inside, lift, on, place};
use crate::task::{Goal, Target};

impl Goal {
    /// Its kind.
    pub fn kind(&self) -> &dyn Kind {
        match &self.target {
            Target::Lift { .. } => &lift::Lift,
            Target::At { .. } => &place::AtPlace,
            Target::On(_) => &on::OnTop,
            Target::In(_) => &inside::Inside,
        }
    }
}
