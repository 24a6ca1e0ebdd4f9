//! Work that may panic inside a library, turned into a value: the process goes on, and nothing is printed.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// How many [`guarded`] calls this thread is inside of.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Does `work`. What it borrowed mutably must be fit for use after a panic at any place: the caller answers for that.
///
/// # Errors
/// The panic's own words; nothing is printed for a panic on this thread.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    silence_guarded_threads();
    DEPTH.set(DEPTH.get() + 1);
    let result = catch_unwind(AssertUnwindSafe(work));
    DEPTH.set(DEPTH.get() - 1);
    result.map_err(|panic| words(panic.as_ref()))
}

/// Puts a hook before the one that stands, once: it stays silent for threads inside of [`guarded`].
fn silence_guarded_threads() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |panic| {
            if DEPTH.get() == 0 {
                before(panic);
            }
        }));
    });
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "a panic without words".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_its_words_and_the_next_work_is_done() {
        let numbers: Vec<u8> = Vec::new();
        let at = numbers.len() + 3;
        assert_eq!(guarded(|| numbers[at]).expect_err("a panic"), "index out of bounds: the len is 0 but the index is 3");
        assert_eq!(guarded(|| panic!("in plain words")).map(|(): ()| 0).expect_err("a panic"), "in plain words");
        let inner_and_outer = guarded(|| guarded(|| numbers[at]).is_err());
        assert_eq!((inner_and_outer, DEPTH.get()), (Ok(true), 0));
    }
}
