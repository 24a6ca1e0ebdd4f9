//! Places for conversations at the same time. Who comes when all are taken gets that of the one who has been silent for longest, if that is long.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Who has been silent for so long gives way to others.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// All places.
#[derive(Debug)]
pub struct Seats {
    most: usize,
    patience: Duration,
    taken: Mutex<Vec<Arc<Place>>>,
}

/// A place that is taken.
#[derive(Debug)]
struct Place {
    /// When its owner was last heard.
    heard: Mutex<Instant>,
    /// Somebody else has it now.
    lost: AtomicBool,
}

/// A place of one's own, as long as the value lives and nobody else needs it more.
#[derive(Debug)]
pub struct Seat<'a> {
    seats: &'a Seats,
    place: Arc<Place>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Seats {
    /// So many, each kept for so long without a word.
    pub fn new(most: usize, patience: Duration) -> Self {
        Seats { most, patience, taken: Mutex::default() }
    }

    /// A place; `None` when all are taken by those who speak.
    pub fn take(&self) -> Option<Seat<'_>> {
        let mut taken = locked(&self.taken);
        if taken.len() >= self.most {
            let (silent, since) = taken.iter().map(|place| *locked(&place.heard)).enumerate().min_by_key(|(_, heard)| *heard)?;
            if since.elapsed() < self.patience {
                return None;
            }
            taken.swap_remove(silent).lost.store(true, Ordering::SeqCst);
        }
        let place = Arc::new(Place { heard: Mutex::new(Instant::now()), lost: AtomicBool::new(false) });
        taken.push(Arc::clone(&place));
        Some(Seat { seats: self, place })
    }
}

impl Seat<'_> {
    /// Its owner has spoken.
    pub fn heard(&self) {
        *locked(&self.place.heard) = Instant::now();
    }

    /// Whether it is somebody else's.
    pub fn is_lost(&self) -> bool {
        self.place.lost.load(Ordering::SeqCst)
    }
}

impl Drop for Seat<'_> {
    fn drop(&mut self) {
        locked(&self.seats.taken).retain(|place| !Arc::ptr_eq(place, &self.place));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread::sleep;

    #[test]
    fn only_who_is_silent_for_long_gives_way() {
        // Longer than a busy machine takes from one line to the next.
        let long = Duration::from_millis(600);
        let seats = Seats::new(2, long);
        let (silent, speaks) = (seats.take().expect("room"), seats.take().expect("room"));
        assert!(seats.take().is_none());
        sleep(long);
        speaks.heard();
        let third = seats.take().expect("the silent one's");
        assert_eq!([&silent, &speaks, &third].map(Seat::is_lost), [true, false, false]);
        drop(silent);
        assert!(seats.take().is_none(), "what is lost is not given back");
        drop(speaks);
        assert!(seats.take().is_some());
    }
}
