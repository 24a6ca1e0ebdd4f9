//! Episodes that fell out: counted and named, never silent.

use super::{Console, Outcome};
use crate::error::{Error, Result};

/// Named one by one up to this many; the rest is counted.
const NAMED: usize = 20;

/// An item, or why it was dropped ("episode 3: ...").
pub type Kept<T> = std::result::Result<T, String>;

/// Keeps what came through and says what did not; `advice` is for when that is everything.
///
/// # Errors
/// [`Error::Failed`] when nothing came through, with the first reason.
pub fn keep<T>(stage: &str, items: Vec<Kept<T>>, advice: &str, console: &Console) -> Result<(Vec<T>, Outcome)> {
    let total = items.len();
    let (mut kept, mut reasons) = (Vec::with_capacity(total), Vec::new());
    for item in items {
        match item {
            Ok(item) => kept.push(item),
            Err(reason) => reasons.push(reason),
        }
    }
    Ok((kept, say(stage, total, &reasons, advice, console)?))
}

/// Says which of `total` episodes fell out, for these `reasons`.
///
/// # Errors
/// As [`keep`].
pub fn say(stage: &str, total: usize, reasons: &[String], advice: &str, console: &Console) -> Result<Outcome> {
    let Some(first) = reasons.first() else {
        return Ok(Outcome::Done);
    };
    if reasons.len() == total {
        let all = if total == 1 {
            "the only episode was dropped".into()
        } else {
            format!("all {total} episodes were dropped; the first")
        };
        return Err(Error::Failed(format!("{stage}: {all}: {first}; {advice}")));
    }
    console.say(&format!("{stage}: left out {} of {total} episodes:", reasons.len()));
    reasons.iter().take(NAMED).for_each(|reason| console.say(&format!("  {reason}")));
    if reasons.len() > NAMED {
        console.say(&format!("  and {} more", reasons.len() - NAMED));
    }
    Ok(Outcome::Dropped(reasons.len() as u64))
}
