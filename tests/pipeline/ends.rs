//! Settings at the ends of what is allowed: within 3 GB, and no panic.

use crate::runs::{HILT, Run, text};
use std::process::Command;

/// Address space that a stage of a tiny run may take [kB]; a run at its defaults takes a tenth.
const MEMORY_KB: u64 = 3_000_000;

/// Each of these takes most of what its range allows: time, steps, weights or rows.
const ENDS: [(&str, &str, &str); 26] = [
    ("plan", "plan.speed=1e-5", "simulate.max_steps can allow"),
    ("plan", "plan.speed=1e-300", "simulate.max_steps can allow"),
    ("plan", "plan.max_acceleration_rad_s2=1e-300", "simulate.max_steps can allow"),
    ("plan", "plan.max_acceleration_rad_s2=100", ""),
    ("plan", "plan.search_iterations=100000", ""),
    ("plan", "scene.base_xy_m=[2, 2]", ""),
    ("simulate", "simulate.max_steps=10000", ""),
    ("simulate", "simulate.max_steps=1", ""),
    ("simulate", "simulate.noise_variance=1", ""),
    ("simulate", "simulate.pulses={probability=1.0, steps=10000, sigma_rad_s=10.0}", ""),
    ("convert", "convert.demos=100000", ""),
    ("pretrain", "pretrain.hidden_layers=16", ""),
    ("pretrain", "pretrain.hidden_units=1024", ""),
    ("pretrain", "pretrain.batch_rows=1000000", ""),
    ("pretrain", "pretrain.learning_rate=1e38", "Eq. 6"),
    ("pretrain", "scene.friction=0", ""),
    ("train", "train.batch=100000", ""),
    ("train", "train.bc_batch=1000000", ""),
    ("train", "train.hidden_layers=16", ""),
    ("train", "train.hidden_units=1024", ""),
    ("train", "train.select_candidates=1000000", ""),
    ("train", "train.tau=1e-6", ""),
    ("train", "train.std_floor=1000", ""),
    ("train", "train.sc.noise_variance=1", ""),
    ("evaluate", "scene.block_mass_kg=0.001", ""),
    ("evaluate", "scene.friction=10", ""),
];

#[test]
fn settings_at_the_ends_of_their_ranges_stay_within_memory() {
    let run = Run::finished();
    for (stage, set, says) in ENDS {
        let words = run.words(stage).into_iter().chain(["--threads", "2", "--set", set].map(String::from));
        let limited = format!("ulimit -v {MEMORY_KB}; exec \"$0\" \"$@\"");
        let output = Command::new("bash").args(["-c", &limited, HILT]).args(words).output().expect("bash runs");
        let stderr = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(0 | 1 | 3)), "{set}: {:?} {stderr}", output.status);
        assert!(stderr.contains(says) && !stderr.contains("panicked"), "{set} should say \"{says}\": {stderr}");
    }
}
