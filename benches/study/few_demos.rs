//! Few demos: BC, SC and HIL on the same demos, with the same inputs, in equal time. No pulses: the demos show the way, not the way back.

use crate::Args;
use crate::chain::{Method, THOROUGH};
use crate::lab::{Lab, Setup, each};
use crate::results::{Row, write};
use anyhow::Result;
use clap::ValueEnum;

/// Training seeds of the study: no selection used them.
const SEEDS: std::ops::RangeInclusive<u64> = 101..=105;
/// One more plan for each ten demos, and two: the demonstrator without pulses fails in less than one of a hundred.
const SPARE_SHARE: u64 = 10;
const SPARE: u64 = 2;

/// What the policy sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Features {
    /// As the settings say.
    Best,
    /// The same without joint velocities.
    Masked,
    /// The state itself.
    Raw,
}

impl Features {
    fn name(self) -> &'static str {
        ["best", "masked", "raw"][self as usize]
    }

    fn sets(self) -> Vec<String> {
        match self {
            Features::Best => Vec::new(),
            Features::Masked => vec!["train.mask_dq=true".into()],
            Features::Raw => vec!["train.features=raw".into()],
        }
    }
}

pub fn run(args: &Args) -> Result<()> {
    let (lab, csv) = (Lab { dir: args.dir.join("few-demos"), threads: args.threads }, args.csv_of("few-demos"));
    let seeds = args.seeds_or(SEEDS);
    // Seed by seed, so that a first comparison is there early.
    let cells: Vec<(u64, u64)> = seeds.iter().flat_map(|seed| args.demos.iter().map(|demos| (*demos, *seed))).collect();
    each(&cells, args.jobs, |&(demos, seed)| cell(args, &lab, demos, seed), |rows| write(&csv, rows))
}

/// All features and methods on one set of demos.
fn cell(args: &Args, lab: &Lab, demos: u64, seed: u64) -> Result<Vec<Row>> {
    let own = [
        "simulate.pulses.probability=0".to_string(),
        format!("convert.demos={demos}"),
        format!("plan.episodes={}", demos + demos / SPARE_SHARE + SPARE),
        format!("evaluate.episodes={}", args.episodes),
    ];
    let sets = [THOROUGH.map(String::from).as_slice(), &own].concat();
    let setup = Setup { pipeline: args.pipeline.clone(), sets, seed }.with(&args.set);
    let label = format!("{demos}-seed-{seed}");
    let made = lab.demos(&label, &setup)?;
    let methods = args.methods_or(&[Method::Bc, Method::Sc, Method::Hil]);
    let mut rows = Vec::new();
    for features in &args.features {
        let label = format!("{label}-{}", features.name());
        let setup = setup.with(&features.sets());
        let labels = [("demos", demos.to_string()), ("features", features.name().to_string())];
        for trained in lab.in_equal_time(&label, &setup, &args.hil_set, &methods, &made)? {
            rows.push(lab.evaluate(&label, &setup, &labels, &trained)?);
        }
    }
    Ok(rows)
}
