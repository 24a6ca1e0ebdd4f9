//! Which compilation of the kernel is the fastest here, found by trying: what a processor's instructions promise does not tell, for some
//! take registers of sixteen floats in halves, and some lower their clock for them.

use super::on;
use super::operation::{Coefficients, Finish, Product, Start};
use super::path::Path;
use crate::nn::lanes::{LANES, Lanes};
use std::time::{Duration, Instant};

/// Entries of a hidden layer, what most products are about.
const WIDTH: usize = 100;
/// As many samples as a gradient's shard has at least: two tiles of the largest.
const PANELS: usize = 8;
/// Trials of each path, in turns, of which the fastest counts: other programs only ever slow one down. Some 10 us each.
const TRIALS: usize = 24;
/// How much faster wider registers must be to be taken: what they lose where few samples are left, and what a trial may err by.
const GAIN: f64 = 1.02;

/// The fastest path that this processor has.
pub fn fastest() -> Path {
    let better = |best: (Path, f64), next: (Path, f64)| {
        // next is narrower
        if next.1 * GAIN > best.1 { next } else { best }
    };
    let mut candidates = candidates();
    match (candidates.next(), candidates.next()) {
        (Some(_), Some(_)) => rates().into_iter().reduce(better).map_or(Path::Portable, |(path, _)| path),
        (only, _) => only.unwrap_or(Path::Portable),
    }
}

/// Every path but the portable one, which is the slowest wherever there is another, the widest first.
fn candidates() -> impl Iterator<Item = Path> {
    Path::available().filter(|path| *path != Path::Portable)
}

/// Operations per second of each candidate.
pub fn rates() -> Vec<(Path, f64)> {
    let paths: Vec<Path> = candidates().collect();
    let (x, matrix) = (vec![Lanes::splat(0.5); PANELS * WIDTH], vec![0.25; WIDTH * WIDTH]);
    let mut result = vec![Lanes::default(); PANELS * WIDTH];
    let mut fastest = vec![Duration::MAX; paths.len()];
    for _ in 0..TRIALS {
        for (path, fastest) in paths.iter().zip(&mut fastest) {
            let started = Instant::now();
            let of =
                Product { x: &x, depth: WIDTH, a: Coefficients::Matrix(&matrix), start: Start::Zero, finish: Finish::Nothing };
            on::product(*path, &mut result, WIDTH, of);
            *fastest = started.elapsed().min(*fastest);
        }
    }
    let operations = (PANELS * LANES * WIDTH * WIDTH * 2) as f64;
    // A clock may be too coarse to see a trial.
    let rate = |time: Duration| operations / time.max(Duration::from_nanos(1)).as_secs_f64();
    paths.into_iter().zip(fastest.into_iter().map(rate)).collect()
}
