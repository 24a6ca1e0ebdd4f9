//! Off the beaten track: BC and HIL in scenes that their demos do not show, and trained again on demos that do.

use crate::Args;
use crate::chain::{Method, THOROUGH};
use crate::lab::{Lab, Setup, each};
use crate::results::{Row, write};
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// Where the varied scenes are.
const PIPELINES: &str = "pipelines/off-track";
/// The ordinary scene among the variations: what there is to lose.
const ORDINARY: &str = "ordinary";

pub fn run(args: &Args) -> Result<()> {
    let (lab, csv) = (Lab { dir: args.dir.join("off-track"), threads: args.threads }, args.csv_of("off-track"));
    let seeds = args.seeds_or(0..3);
    // The ordinary policies first: every variation evaluates them.
    each(&seeds, args.jobs, |seed| ordinary(args, &lab, *seed), |rows| write(&csv, rows))?;
    let names = if args.variations.is_empty() { all()? } else { args.variations.clone() };
    let cells: Vec<(&str, u64)> = names.iter().flat_map(|name| seeds.iter().map(move |seed| (name.as_str(), *seed))).collect();
    let first: Vec<Vec<Row>> = seeds.iter().map(|seed| ordinary(args, &lab, *seed)).collect::<Result<_>>()?;
    let work = |(name, seed): &(&str, u64)| varied(args, &lab, name, *seed);
    each(&cells, args.jobs, work, |rows| write(&csv, &[first.as_slice(), rows].concat()))
}

/// Names of the pipelines, sorted.
fn all() -> Result<Vec<String>> {
    let entries = fs::read_dir(PIPELINES).with_context(|| format!("cannot read {PIPELINES}"))?;
    let mut names = Vec::new();
    for entry in entries {
        let path = entry?.path();
        names.extend(path.file_stem().and_then(|stem| stem.to_str()).map(String::from));
    }
    names.sort();
    Ok(names)
}

fn setup(args: &Args, pipeline: PathBuf, seed: u64) -> Setup {
    let sets = THOROUGH.map(String::from).into_iter().chain([format!("evaluate.episodes={}", args.episodes)]).collect();
    Setup { pipeline, sets, seed }.with(&args.set)
}

/// The ordinary policies in the ordinary scene.
fn ordinary(args: &Args, lab: &Lab, seed: u64) -> Result<Vec<Row>> {
    let usual = setup(args, args.pipeline.clone(), seed);
    compare(args, lab, (ORDINARY, &usual), (ORDINARY, &usual))
}

/// Both kinds of policies in one varied scene.
fn varied(args: &Args, lab: &Lab, name: &str, seed: u64) -> Result<Vec<Row>> {
    let usual = setup(args, args.pipeline.clone(), seed);
    let scene = setup(args, Path::new(PIPELINES).join(format!("{name}.toml")), seed);
    let mut rows = compare(args, lab, (ORDINARY, &usual), (name, &scene))?;
    rows.extend(compare(args, lab, (name, &scene), (name, &scene))?);
    Ok(rows)
}

/// Trains on the demos of one scene, as the ordinary pipeline says, and evaluates in another.
fn compare(args: &Args, lab: &Lab, shown: (&str, &Setup), met: (&str, &Setup)) -> Result<Vec<Row>> {
    let usual = setup(args, args.pipeline.clone(), met.1.seed);
    let label = format!("{}-seed-{}", shown.0, usual.seed);
    let demos = lab.demos(&label, shown.1)?;
    let methods = args.methods_or(&[Method::Bc, Method::Hil]);
    let labels = [("variation", met.0.to_string()), ("covered", (shown.0 == met.0).to_string())];
    let trained = lab.in_equal_time(&label, &usual, &args.hil_set, &methods, &demos)?;
    trained.iter().map(|t| lab.evaluate(&format!("{label}-in-{}", met.0), met.1, &labels, t)).collect()
}
