//! What accuracy and speed the settings of the contact physics give: one line for each.

use super::Args;
use super::trials::{End, Errors, episode, errors, plans, scripted_episode, timed};
use anyhow::{Result, ensure};
use hilt::config::SimulateSettings;
use hilt::plan::Plan;
use hilt::sim::{Grain, Physics};
use hilt::task::built_in::of_the_paper;
use hilt::tasks::FailureClass;

/// Ten times the variance of the noise: what is just good enough elsewhere fails here.
const MORE_NOISE: f64 = 10.0;
/// Episodes of each task that are timed, and how often, the settings in turns.
const TIMED: usize = 3;
const ROUNDS: usize = 10;
/// Most episodes of a cell.
const MOST_EPISODES: u64 = 100;

/// Everything in control steps divided like this.
fn all(steps: usize, substeps: usize, sweeps: usize) -> Physics {
    let grain = Grain { steps, substeps, sweeps };
    Physics { near: grain, free: grain, ..Physics::default() }
}

/// The default near things, this where nothing can touch.
fn free(steps: usize, substeps: usize, sweeps: usize) -> Physics {
    Physics { free: Grain { steps, substeps, sweeps }, ..Physics::default() }
}

/// The settings under study by name; steps x substeps x sweeps.
fn candidates() -> Vec<(&'static str, Physics)> {
    let default = Physics::default();
    vec![
        ("default", default),
        ("2 x 8 x 12", all(2, 8, 12)),
        ("2 x 8 x 6", all(2, 8, 6)),
        ("2 x 4 x 8", all(2, 4, 8)),
        ("2 x 4 x 4", all(2, 4, 4)),
        ("2 x 4 x 3", all(2, 4, 3)),
        ("2 x 3 x 6", all(2, 3, 6)),
        ("2 x 3 x 8", all(2, 3, 8)),
        ("2 x 2 x 6", all(2, 2, 6)),
        ("1 x 8 x 6", all(1, 8, 6)),
        ("1 x 6 x 6", all(1, 6, 6)),
        ("1 x 4 x 6", all(1, 4, 6)),
        ("free 2 x 2 x 6", free(2, 2, 6)),
        ("free 1 x 4 x 6", free(1, 4, 6)),
        ("free 1 x 2 x 6", free(1, 2, 6)),
        ("free 1 x 1 x 6", free(1, 1, 6)),
        ("no relaxation", Physics { relaxations: 0, ..default }),
        ("prediction 5 mm", Physics { prediction_m: 0.005, ..default }),
        ("prediction 10 mm", Physics { prediction_m: 0.01, ..default }),
        ("free 1 x 2 x 6 and prediction 10 mm", Physics { prediction_m: 0.01, ..free(1, 2, 6) }),
        ("recycle 10 mm", Physics { recycle_m: 0.01, ..default }),
        ("contact 100 Hz", Physics { contact_hz: 100.0, ..default }),
        ("contact 400 Hz", Physics { contact_hz: 400.0, ..default }),
        ("no sweeps of fast bodies", Physics { continuous: false, ..default }),
    ]
}

/// Prints the table: the median and the largest error of the positions, then how many episodes are solved.
pub fn run(args: &Args) -> Result<()> {
    let count = args.episodes.min(MOST_EPISODES);
    let chosen = |name: &str| args.variations.is_empty() || args.variations.iter().any(|v| v == name);
    let candidates: Vec<_> = candidates().into_iter().filter(|(name, _)| chosen(name)).collect();
    ensure!(!candidates.is_empty(), "--variations names no setting: the first column of the whole table does");
    let planned = of_the_paper().map(|task| plans(&task, count));
    let few: Vec<&Plan> = planned.iter().flat_map(|plans| plans.iter().take(TIMED)).collect();
    let speeds = steps_per_s(&few, &candidates);
    println!(
        "| settings | steps/s | hold mm | swing mm | drift um | rammed mm | tracking mrad | pick-up | place | stack | scripted stack, noise x 10 |"
    );
    println!("|{}", "---|".repeat(11));
    let usual = SimulateSettings::default().noise_variance;
    for ((name, physics), speed) in candidates.iter().zip(speeds) {
        let Errors { hold, swing, drift, rammed, tracking } = errors(*physics);
        print!("| {name} | {speed:.0} |");
        for ([median, largest], unit) in [(hold, 1e3), (swing, 1e3), (drift, 1e6), (rammed, 1e3), (tracking, 1e3)] {
            print!(" {:.3} to {:.3} |", unit * median, unit * largest);
        }
        for plans in &planned {
            print!(" {} |", counted(plans.iter().map(|plan| episode(plan, *physics, usual))));
        }
        let [_, _, stack] = &planned;
        println!(" {} |", counted(stack.iter().map(|plan| scripted_episode(plan, *physics, MORE_NOISE * usual))));
    }
    Ok(())
}

/// Control steps per second of each setting; of each episode the fastest run counts.
fn steps_per_s(plans: &[&Plan], candidates: &[(&str, Physics)]) -> Vec<f64> {
    let mut best = vec![vec![f64::INFINITY; plans.len()]; candidates.len()];
    let mut steps = vec![0; candidates.len()];
    for round in 0..ROUNDS {
        for (c, (_, physics)) in candidates.iter().enumerate() {
            for (plan, best) in plans.iter().zip(&mut best[c]) {
                let (made, seconds) = timed(plan, *physics);
                *best = best.min(seconds);
                steps[c] += if round == 0 { made } else { 0 };
            }
        }
    }
    best.iter().zip(steps).map(|(seconds, steps)| steps as f64 / seconds.iter().sum::<f64>()).collect()
}

/// "98 (1 dropped, 1 toppled)".
fn counted(ends: impl Iterator<Item = End>) -> String {
    let ends: Vec<End> = ends.collect();
    let of = |class: Option<FailureClass>| ends.iter().filter(|end| end.failure == class).count();
    let failed = FailureClass::ALL.into_iter().map(|class| (of(Some(class)), class.name())).filter(|(n, _)| *n > 0);
    let failed: Vec<String> = failed.map(|(n, name)| format!("{n} {name}")).collect();
    if failed.is_empty() { of(None).to_string() } else { format!("{} ({})", of(None), failed.join(", ")) }
}
