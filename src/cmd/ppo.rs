//! `hilt train --method ppo`: no dataset, but the simulator itself.

use super::checkpoint::{self, Keeper};
use super::common::path_or;
use super::places::{Content, beside};
use super::train::{Args, KIND, announce};
use super::{Context, Outcome};
use crate::config::{Pipeline, Stage};
use crate::data::{atomic, table_file, weights};
use crate::env::Env;
use crate::error::Result;
use crate::learn::{
    Checkpoint, Ppo,
    ppo::{METRICS, Row},
};
use crate::sim::TaskEnv;
use crate::table::{Table, Values};
use serde_json::Value;
use std::time::{Duration, Instant};

/// What of an iteration is told while it runs.
const TOLD: [&str; 6] = ["success_rate", "mean_return", "mean_length", "kl", "entropy", "explained"];

pub fn run(args: &Args, pipeline: &Pipeline, context: &Context) -> Result<Outcome> {
    let (console, seed, settings) = (&context.console, args.settings.seed, &pipeline.train);
    let out = path_or(args.out.as_deref(), pipeline.task, "policy-ppo.safetensors");
    let metrics = args.metrics.clone().unwrap_or_else(|| beside(&out, "training.parquet"));
    let kept = beside(&out, checkpoint::ENDING);
    let places = args.settings.places().write("--out", &out, Content::Weights(KIND, "train"));
    let checkpoint = if args.resume { Content::Own } else { Content::Weights(weights::CHECKPOINT, "train") };
    places.write("--metrics", &metrics, Content::Table("train")).write("the checkpoint", &kept, checkpoint).check(console)?;
    let mut provenance = args.settings.provenance(Stage::Train, pipeline, &[])?;
    provenance.settings["method"] = "ppo".into();

    let resume = if args.resume { checkpoint::read(&kept, &provenance)? } else { None };
    announce(console, args.resume, resume.as_ref(), &kept);
    let mut keeper = Keeper::new(&kept, &provenance, console, resume.as_ref());
    let make = |_| -> Result<Box<dyn Env>> { Ok(Box::new(TaskEnv::new(pipeline, seed))) };
    let mut ppo = Ppo::new(pipeline.task, settings, seed, make)?;
    let mut past = Past::default();
    if let Some(checkpoint) = &resume {
        ppo.restore(&checkpoint.tensors, &checkpoint.meta)?;
        past = Past::of(&checkpoint.meta);
    }
    let every = (args.checkpoint_every > 0).then(|| Duration::from_secs(args.checkpoint_every));
    learn(&mut ppo, &mut past, settings.ppo.iterations(), every, &mut keeper, context).map_err(|why| keeper.explain(why))?;
    let policy = ppo.policy();
    let weights = weights::encode(&out, KIND, &policy.to_tensors(), &policy.meta(), &provenance)?;
    let table = table_file::encode(&metrics, &past.table(), &provenance)?;
    atomic::write_all(&[(metrics, table), (out.clone(), weights)])?;
    keeper.remove()?;
    console.say(&format!("train: wrote {}", out.display()));
    Ok(Outcome::Done)
}

/// Iteration by iteration; the last whole one is kept when it ends early.
fn learn(
    ppo: &mut Ppo,
    past: &mut Past,
    iterations: u64,
    every: Option<Duration>,
    keeper: &mut Keeper,
    context: &Context,
) -> Result<()> {
    let (began, done) = (Instant::now(), ppo.steps());
    let progress = context.console.progress("ppo", iterations, "iterations").after(ppo.iterations());
    let mut kept = Instant::now();
    while ppo.iterations() < iterations {
        let before = past.checkpoint(ppo);
        match ppo.iteration(&|| context.interrupt.check()) {
            Ok(row) => past.rows.push(row),
            Err(why) => {
                keeper.keep(&before);
                return Err(why);
            }
        }
        progress.step_with(&past.words());
        if every.is_some_and(|every| kept.elapsed() >= every) {
            keeper.keep(&past.checkpoint(ppo));
            kept = Instant::now();
        }
    }
    let rate = (ppo.steps() - done) as f64 / began.elapsed().as_secs_f64();
    progress.finish(&format!(", {} steps, {rate:.0} a second", ppo.steps()));
    Ok(())
}

/// The iterations so far.
#[derive(Default)]
struct Past {
    rows: Vec<Row>,
}

impl Past {
    /// What a checkpoint has kept: the bits, for JSON has no NaN.
    fn of(meta: &Value) -> Past {
        let bits: Vec<[u64; METRICS.len()]> = serde_json::from_value(meta["rows"].clone()).unwrap_or_default();
        Past { rows: bits.into_iter().map(|row| row.map(f64::from_bits)).collect() }
    }

    fn checkpoint(&self, ppo: &Ppo) -> Checkpoint {
        let (tensors, mut meta) = ppo.save();
        meta["rows"] = self.rows.iter().map(|row| Value::from(row.map(f64::to_bits).to_vec())).collect();
        Checkpoint { tensors, meta }
    }

    /// Of the last iteration, what is told.
    fn words(&self) -> String {
        let Some(row) = self.rows.last() else { return String::new() };
        let told = METRICS.iter().zip(row).filter(|([name, _], value)| TOLD.contains(name) && value.is_finite());
        told.map(|([name, _], value)| format!(", {} {value:.3}", name.replace('_', " "))).collect()
    }

    /// A row an iteration.
    fn table(&self) -> Table {
        METRICS.iter().enumerate().fold(Table::default(), |table, (i, [name, doc])| {
            table.with(name, doc, Values::F64(self.rows.iter().map(|row| row[i]).collect()))
        })
    }
}
