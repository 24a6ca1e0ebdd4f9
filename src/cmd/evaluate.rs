use super::common::{SettingsArgs, path_or};
use super::page::{PageArgs, atlas, title_of};
use super::places::{Content, Places, beside};
use super::subject::{Chosen, ServedArgs, Subject};
use super::{Console, Context, Outcome, output};
use crate::config::Stage;
use crate::data::differences::{Difference, differences};
use crate::data::origin::Kind;
use crate::data::provenance::Provenance;
use crate::data::{atomic, json_file, recording, table_file, weights};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::eval::{Rollouts, Summary, Trial, to_table};
use crate::report::table::text_table;
use crate::scene::Scene;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Run a policy on seeded episodes that no demonstration used: success with its 95 % interval, conditions, failure classes.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  hilt evaluate --policy policy.safetensors --episodes 500 --record rollouts --out evaluation.json\n  hilt evaluate --policy policy-bc.safetensors --episodes 500 --out evaluation-bc.json\n  hilt evaluate --task stack --policy planner --episodes 500 --json"
)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Weights of a policy, "planner" for the demonstrator itself, or the address of a policy that somebody serves [default:
    /// runs/<TASK>/policy.safetensors]
    #[arg(long, value_name = "planner|FILE|ws://HOST:PORT")]
    policy: Option<PathBuf>,
    #[command(flatten)]
    served: ServedArgs,
    /// Episodes [default: evaluate.episodes]
    #[arg(long, value_name = "N")]
    episodes: Option<u64>,
    /// Sample actions from the policy's Gaussian instead of taking its mean
    #[arg(long)]
    stochastic: bool,
    /// Print the summary as JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Write the summary to this JSON file and the log of the episodes beside it, <name>.episodes.parquet
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Record every episode as MCAP into this directory
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// With --record: write a page beside that directory, DIR.html, with how the episodes end, where they start, and of each way to end the first N to
    /// look at
    #[arg(long, value_name = "N", requires = "record", value_parser = clap::value_parser!(u32).range(1..=16))]
    render: Option<u32>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let episodes = ("evaluate.episodes", args.episodes.map(|n| n.to_string()));
    let stochastic = ("evaluate.stochastic", args.stochastic.then(|| "true".to_string()));
    let artefact = args.policy.as_deref().and_then(Chosen::file).map(|path| (path, Kind::Weights(weights::POLICY)));
    let pipeline = args.settings.resolve_from(artefact, &[episodes, stochastic])?;
    let path = path_or(args.policy.as_deref(), &pipeline, "policy.safetensors");
    let log = args.out.as_deref().map(|out| beside(out, "episodes.parquet"));
    args.places(&path, log.as_deref(), &context.console).check(&context.console)?;
    let Chosen { subject, content, trained, said } = Chosen::read(&path, &args.served, &pipeline, &context.interrupt)?;
    let inputs: Vec<_> = content.map(|content| ("policy", content)).into_iter().collect();
    let horizon_steps = subject.horizon_steps(&pipeline);
    let mut provenance = args.settings.provenance(Stage::Evaluate, &pipeline, &inputs)?;
    provenance.settings["evaluate"]["horizon_steps"] = horizon_steps.into();
    provenance.settings["policy"] = said;

    let foreign = trained.map(|trained| of_scene(&trained, &provenance.settings)).unwrap_or_default();
    say_of_scene(&foreign, &context.console);
    let rollouts = Rollouts::evaluation(&pipeline, args.settings.seed, horizon_steps);
    let trials = match &args.record {
        None => run_all(&rollouts, &subject, context, |_| Ok(()))?,
        Some(dir) => record_all(dir, &rollouts, &subject, context, &provenance)?,
    };
    let summary = Summary::of(&pipeline.task, &trials);
    let stated = Stated::new(&summary, &foreign);
    if let (Some(out), Some(log)) = (&args.out, log) {
        let value = serde_json::to_value(&stated).map_err(|e| Error::Failed(format!("cannot write JSON: {e}")))?;
        let table = table_file::encode(&log, &to_table(&pipeline.task, &trials), &provenance)?;
        atomic::write_all(&[(log, table), (out.clone(), json_file::encode(out, &value, &provenance)?)])?;
    }
    // What can fail comes after what took so long.
    write_atlas(args, context)?;
    if args.json {
        output::print_json(&stated)?
    } else {
        output::print(&words(&pipeline.task.condition_names(), &summary, &trials))?
    }
    Ok(Outcome::Done)
}

impl Args {
    fn places(&self, policy: &Path, log: Option<&Path>, console: &Console) -> Places {
        let mut places = self.settings.places(console).read_all(Chosen::file(policy)).read_all(self.served.reads());
        if let (Some(out), Some(log)) = (&self.out, log) {
            places = places.write("--out", out, Content::Summary("evaluate"));
            places = places.write("the log of the episodes", log, Content::Table("evaluate"));
        }
        if let Some(page) = self.atlas_page() {
            places = places.write("the page beside --record", &page, Content::Page);
        }
        match &self.record {
            Some(dir) => places.write("--record", dir, Content::Recordings("evaluate")),
            None => places,
        }
    }

    /// Where the page of --render goes.
    fn atlas_page(&self) -> Option<PathBuf> {
        let dir = self.render.and(self.record.as_deref())?;
        let name = dir.file_name().unwrap_or(OsStr::new("episodes")).to_string_lossy();
        Some(dir.with_file_name(format!("{name}.html")))
    }
}

/// The page of --render.
fn write_atlas(args: &Args, context: &Context) -> Result<()> {
    let (Some(page), Some(dir), Some(most)) = (args.atlas_page(), &args.record, args.render) else { return Ok(()) };
    let text = atlas(&title_of(std::slice::from_ref(dir)), dir, most as usize, &PageArgs::default(), context)?;
    atomic::write_bytes(&page, text.as_bytes())?;
    context.console.say(&format!("evaluate: wrote {}", page.display()));
    Ok(())
}

/// Sections of the settings that make an episode what it is.
const WORLD: [&str; 3] = ["scene", "simulate", "robot"];

/// Those sections of a policy's settings.
pub(super) fn world(settings: &Value) -> Value {
    WORLD.iter().map(|section| (section.to_string(), settings[*section].clone())).collect()
}

/// In what the episodes differ from those that the policy was trained for.
fn of_scene(trained: &Value, here: &Value) -> Vec<Difference> {
    WORLD.iter().flat_map(|section| differences(section, &trained[*section], &here[*section])).collect()
}

fn say_of_scene(foreign: &[Difference], console: &Console) {
    for Difference { key, theirs, ours } in foreign {
        console
            .say(&format!("evaluate: {key} is {ours}, the policy was trained with {theirs}: another scene than it has learned"));
    }
}

/// What scripts read.
#[derive(Serialize)]
struct Stated<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    /// Where the scene is another than the policy was trained for: by key, \[trained, here\].
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    differs_from_training: BTreeMap<&'a str, [&'a Value; 2]>,
}

impl<'a> Stated<'a> {
    fn new(summary: &'a Summary, foreign: &'a [Difference]) -> Self {
        let differs_from_training = foreign.iter().map(|d| (d.key.as_str(), [&d.theirs, &d.ours])).collect();
        Stated { summary, differs_from_training }
    }
}

fn run_all<K>(rollouts: &Rollouts, subject: &Subject, context: &Context, keep: K) -> Result<Vec<Trial>>
where
    K: Fn(&Episode) -> Result<()> + Sync,
{
    let progress = context.console.progress("evaluate", rollouts.episodes, "episodes");
    let make = |index, scene: &Scene| {
        let controller = subject.controller(rollouts, index, scene, &context.interrupt)?;
        context.interrupt.check().map(|()| controller)
    };
    let trials = rollouts.run(make, &context.interrupt, |episode| {
        subject.check()?;
        progress.step();
        episode.map_or(Ok(()), &keep)
    })?;
    let steps: u64 = trials.iter().map(|t| t.steps).sum();
    progress.finish(&format!(", {steps} control steps, horizon {}", rollouts.horizon_steps));
    Ok(trials)
}

fn record_all(
    dir: &Path,
    rollouts: &Rollouts,
    subject: &Subject,
    context: &Context,
    provenance: &Provenance,
) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    atomic::write_dir(dir, recording::is_file, |fresh| {
        trials = run_all(rollouts, subject, context, |episode| {
            let file = fresh.join(recording::file_name(episode.index));
            atomic::write_new(&file, &recording::encode(&file, episode, provenance)?)
        })?;
        Ok(())
    })?;
    Ok(trials)
}

/// The table for people; `conditions` in the order of the task.
fn words(conditions: &[String], summary: &Summary, trials: &[Trial]) -> String {
    let share = |n: u64| format!("{:.1} %", 100.0 * n as f64 / summary.episodes.max(1) as f64);
    let row = |name: &str, n: u64| vec![name.to_string(), n.to_string(), share(n)];
    let [low, high] = summary.wilson_95.map(|v| 100.0 * v);
    let mut rows = vec![row("success", summary.successes)];
    rows.extend(conditions.iter().map(|name| row(&format!("  {name}"), summary.conditions[name])));
    rows.push(row("failed", summary.episodes - summary.successes));
    rows.extend(summary.failures.iter().filter(|(_, n)| **n > 0).map(|(class, n)| row(&format!("  {class}"), *n)));
    if trials.iter().any(|t| !t.scene.obstacles.is_empty()) {
        rows.push(row("hit an obstacle", trials.iter().filter(|t| t.hit_obstacle).count() as u64));
    }
    format!(
        "{}{}: success {} of {} (95 % interval {low:.1} to {high:.1} %), steps p50 {} p95 {}\n",
        text_table(&["at the end", "episodes", "share"], &rows),
        summary.task,
        summary.successes,
        summary.episodes,
        summary.episode_steps.p50,
        summary.episode_steps.p95
    )
}
