//! How an epoch over the transitions of demos is cut into updates.

use crate::learn::models::Corpus;
use rand::RngExt;
use rand::seq::SliceRandom;

/// How an epoch is cut into updates.
pub struct Batches<'a> {
    corpus: &'a Corpus,
    /// Transitions per update; 0 = one whole demo.
    rows: usize,
}

impl<'a> Batches<'a> {
    /// Of the transitions of `corpus`, `rows` a batch.
    pub fn new(corpus: &'a Corpus, rows: usize) -> Self {
        Batches { corpus, rows: rows.min(corpus.rows()) }
    }

    /// Updates in an epoch; transitions that do not fill a batch wait for the next shuffle.
    pub fn per_epoch(&self) -> u64 {
        self.corpus.rows().checked_div(self.rows).unwrap_or(self.corpus.demos()) as u64
    }

    /// One batch by itself: transitions may come twice.
    pub fn draw(&self, rng: &mut impl rand::Rng) -> Vec<usize> {
        if self.rows == 0 {
            return self.corpus.demo(rng.random_range(0..self.corpus.demos())).collect();
        }
        (0..self.rows).map(|_| rng.random_range(0..self.corpus.rows())).collect()
    }

    /// The batches of one epoch, in random order.
    pub fn shuffled(&self, rng: &mut impl rand::Rng) -> Epoch {
        let transitions = self.corpus.rows();
        if let Some(count) = transitions.checked_div(self.rows) {
            let mut rows: Vec<usize> = (0..transitions).collect();
            rows.shuffle(rng);
            return Epoch { rows, ends: (1..=count).map(|i| i * self.rows).collect() };
        }
        let mut order: Vec<usize> = (0..self.corpus.demos()).collect();
        order.shuffle(rng);
        let mut epoch = Epoch { rows: Vec::with_capacity(transitions), ends: Vec::with_capacity(order.len()) };
        for demo in order {
            epoch.rows.extend(self.corpus.demo(demo));
            epoch.ends.push(epoch.rows.len());
        }
        epoch
    }
}

/// The batches of one epoch side by side.
pub struct Epoch {
    rows: Vec<usize>,
    ends: Vec<usize>,
}

impl Epoch {
    /// The transitions of each batch.
    pub fn iter(&self) -> impl Iterator<Item = &[usize]> {
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| &self.rows[start..*end])
    }
}
