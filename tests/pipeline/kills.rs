//! `plan` and `simulate` killed at moments spread over their work, and continued.

use crate::continued::{done, pieces, with};
use crate::runs::{HILT, Run, contents};
use std::fs;
use std::process::Command;
use std::time::Instant;

/// A minute: `cargo test --release --locked --test pipeline ten_kills -- --ignored --nocapture`.
#[test]
#[ignore = "takes a minute"]
fn ten_kills_at_moments_of_plan_and_simulate_leave_the_bytes_of_an_undisturbed_run() {
    const MOMENTS: u32 = 5;
    let whole = Run::new("pick-up", 0);
    for (stage, flags, artefact) in
        [("plan", ["--episodes", "400"], "plans.parquet"), ("simulate", ["--episodes", "60"], "recordings")]
    {
        let began = Instant::now();
        done(with(&whole, stage, &flags));
        let undisturbed = began.elapsed();
        for moment in 1..=MOMENTS {
            let run = Run::new("pick-up", 0);
            if stage == "simulate" {
                fs::copy(whole.at("plans.parquet"), run.at("plans.parquet")).expect("copied");
            }
            let mut child = Command::new(HILT).args(with(&run, stage, &flags)).arg("--quiet").spawn().expect("the binary runs");
            let wait = undisturbed * moment / (MOMENTS + 1);
            std::thread::sleep(wait);
            child.kill().expect("killed");
            child.wait().expect("ended");
            let kept = run.at(artefact).with_extension("unfinished");
            let (count, there) = (pieces(&kept).len(), run.at(artefact).exists());
            let words = done(with(&run, stage, &flags));
            assert_eq!(words.contains("goes on: "), count > 0, "{words}");
            println!("{stage} killed after {wait:.1?} of {undisturbed:.1?}: {count} pieces kept, artefact there: {there}");
            run.unchanged(stage, &contents(whole.path()));
        }
    }
}
