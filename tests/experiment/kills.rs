//! A sweep killed at random moments.

use crate::sweep::{STEPS, Sweep, TINY, same};
use std::process::Command;
use std::time::{Duration, Instant};

/// Kills of a sweep.
const KILLS: u32 = 5;

/// A number in \[0, 1) that differs from run to run of the tests.
fn random() -> f64 {
    let nanos = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970").subsec_nanos();
    f64::from(nanos.wrapping_mul(2_654_435_761) >> 8) / f64::from(1_u32 << 24)
}

fn killed_and_undisturbed(text: &str) {
    let (whole, killed) = (Sweep::new(text), Sweep::new(text));
    let began = Instant::now();
    whole.done(&["--jobs", "1", "--threads", "2"]);
    let undisturbed = began.elapsed();
    for kill in 0..KILLS {
        // Of the time that a fifth of the sweep takes, so that the later kills find work too.
        let wait = undisturbed.mul_f64(2.0 * random() / f64::from(KILLS + 1)).max(Duration::from_millis(5));
        let mut child = killed.start(&["--jobs", "2", "--threads", "2"]);
        std::thread::sleep(wait);
        // The runner alone, whose steps go on to their end, or all of them, in the middle of whatever they do.
        let whole_group = kill % 2 == 0;
        if whole_group {
            let group = format!("-{}", child.id());
            assert!(Command::new("kill").args(["-KILL", "--", &group]).status().expect("kill runs").success());
        }
        // It may have ended by itself.
        let _ = child.kill();
        child.wait().expect("ended");
        println!("kill {kill} after {wait:.1?} of {undisturbed:.1?}, with its steps: {whole_group}");
    }
    killed.done(&["--jobs", "2", "--threads", "2"]);
    same(&killed.results(), &whole.results());
}

#[test]
fn a_sweep_killed_at_five_random_moments_ends_with_the_bytes_of_an_undisturbed_one() {
    killed_and_undisturbed(TINY);
}

/// Some minutes: `cargo test --release --locked --test experiment -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes"]
fn a_longer_sweep_killed_ends_with_the_bytes_of_an_undisturbed_one() {
    let longer = TINY.replace("plan.episodes=4", "plan.episodes=40").replace("warm_start_updates=10", "warm_start_updates=2000");
    killed_and_undisturbed(&longer.replace("[11, 12]", "\"11-14\""));
}

#[test]
fn what_is_finished_is_not_done_again() {
    let sweep = Sweep::new(TINY);
    let words = sweep.done(&[]);
    assert!(words.contains(&format!("{STEPS} of {STEPS} steps to do")), "{words}");
    let before = sweep.results();
    let words = sweep.done(&[]);
    assert!(words.contains(&format!("0 of {STEPS} steps to do")), "{words}");
    same(&sweep.results(), &before);

    // A missing or damaged artefact is made again, and nothing else.
    let policy = sweep.at("runs/experiments/tiny/pick-up/seed-11/best/rho-0.6/hil/policy.safetensors");
    let plans = sweep.at("runs/experiments/tiny/pick-up/seed-12/best/plans.parquet");
    let mut bytes = std::fs::read(&policy).expect("a policy");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    std::fs::write(&policy, bytes).expect("damaged");
    std::fs::remove_file(plans).expect("removed");
    let words = sweep.done(&["--jobs", "1"]);
    // Everything of seed 12 waits for its plans, and turns out to be there.
    assert!(!words.contains("0 of "), "{words}");
    same(&sweep.results(), &before);
}
