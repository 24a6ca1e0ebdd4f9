//! A method that hilt does not ship, written against its public API: `docs/add-a-method.md`, followed.

use hilt::config::TrainSettings;
use hilt::data::provenance::Provenance;
use hilt::data::{dataset, weights};
use hilt::error::{Error, Result};
use hilt::interrupt::Interrupt;
use hilt::learn::losses::{Acted, PolicyLoss};
use hilt::learn::methods::batches::Batches;
use hilt::learn::methods::descent::{Counts, Descent};
use hilt::learn::models::{Dynamics, Policy, PolicySamples, Reader, Samples};
use hilt::learn::run::{EpochMetrics, Mean, Method, Metric, Saved, Stage};
use hilt::learn::{Hooks, Inputs, Trained, run};
use hilt::nn::{LANES, Lanes, cosine};
use hilt::seed::stream;
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::Path;

/// Standardised error from which on it counts by its size and no longer by its square.
const KNEE: f32 = 0.5;
const HUBER: &str = "huber";
static METRICS: [Metric; 3] = [
    Metric::shown("l_huber", "l_huber", "Huber loss of the mean action, mean over the epoch's updates"),
    Metric::shown("validation_l_huber", "validation l_huber", "The same of the averaged weights on the validation demos"),
    Metric::column("skipped_updates", "Updates left out so far because a gradient was not finite"),
];

/// Behavior cloning that outliers among the commands pull at no harder than others.
pub struct Huber {
    inputs: Inputs,
    settings: TrainSettings,
    seed: u64,
    descent: Descent,
    acted: Acted,
    loss: PolicyLoss,
}

impl Huber {
    /// A fresh policy for these demos.
    pub fn new(inputs: Inputs, settings: &TrainSettings, seed: u64) -> Result<Self> {
        settings.validate()?;
        let policy = Policy::new(&inputs.train, settings, &mut stream(seed, "train.init", 0));
        let loss = PolicyLoss::new("the Huber loss", inputs.train.layout.action_dim(), settings.bc_batch);
        let (descent, settings) = (Descent::new(policy, settings), settings.clone());
        Ok(Huber { inputs, settings, seed, descent, acted: Acted::default(), loss })
    }
}

/// The loss over transitions `rows`, and its gradient with respect to the mean actions there.
fn huber(samples: PolicySamples, rows: &[usize], acted: &mut Acted, loss: &mut PolicyLoss) -> Result<f64> {
    acted.forward(samples, rows, None);
    loss.begin(rows.len());
    let (mut left, scale) = (rows, 1.0 / (rows.len() * samples.corpus.layout.action_dim()) as f32);
    for (shard, d_mean) in acted.shards().iter().zip(&mut loss.d_mean) {
        let (own, later) = left.split_at(shard.rows);
        left = later;
        for (p, rows) in own.chunks(LANES).enumerate() {
            let labels = d_mean.panel_mut(p); // eight transitions side by side; the slopes take the labels' place
            samples.write_targets(rows, labels);
            for (label, mean) in labels.iter_mut().zip(shard.pass.output.panel(p)) {
                let mut slope = Lanes::default(); // 0 where there is no transition
                for lane in 0..rows.len() {
                    let error = mean.0[lane] - label.0[lane];
                    let bounded = error.clamp(-KNEE, KNEE);
                    loss.value += f64::from(scale * bounded * (error - 0.5 * bounded));
                    slope.0[lane] = scale * bounded;
                }
                *label = slope;
            }
        }
    }
    let (name, value) = (loss.name, loss.value);
    if value.is_finite() { Ok(value) } else { Err(Error::Failed(format!("{name} is {value}: lower train.learning_rate"))) }
}

impl Method for Huber {
    fn stages(&self) -> Vec<Stage> {
        vec![Stage { name: HUBER, epochs: self.settings.epochs }]
    }

    fn metrics(&self) -> &'static [Metric] {
        &METRICS
    }

    fn begin(&mut self, _stage: &str) {
        self.descent.begin_stage();
    }

    fn epoch(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt) -> Result<EpochMetrics> {
        let Huber { inputs: Inputs { train, validation }, settings, seed, descent, acted, loss } = self;
        let (batches, mut mean) = (Batches::new(train, settings.bc_batch), Mean::default());
        let updates = stage.epochs * batches.per_epoch();
        for rows in batches.shuffled(&mut stream(*seed, "train.huber", epoch)).iter() {
            interrupt.check()?;
            mean.add(huber(PolicySamples { corpus: train, policy: &descent.policy }, rows, acted, loss)?);
            let rate = cosine(settings.learning_rate, settings.final_learning_rate, descent.updates, updates);
            descent.update(acted, 1.0 * &*loss, rate);
        }
        descent.update_averaged();
        let rows: Vec<usize> = (0..validation.rows()).collect();
        let held_out = huber(PolicySamples { corpus: validation, policy: &descent.averaged }, &rows, acted, loss)?;
        let mut row = EpochMetrics::new(stage.name, epoch + 1, stage.epochs);
        row.updates = descent.updates;
        let values = [mean.get(), held_out, descent.skipped as f64];
        METRICS.iter().zip(values).for_each(|(metric, value)| row.set(metric.name, value));
        Ok(row)
    }

    fn end(&mut self, _stage: &str) {
        self.descent.end_stage();
    }

    fn candidate(&self) -> &Policy {
        &self.descent.averaged
    }

    fn save(&self) -> Saved {
        let mut tensors = Vec::new();
        let counts = self.descent.save(&mut tensors);
        Saved { tensors, counts: json!(counts) }
    }

    fn restore(&mut self, counts: &Value, tensors: &Reader, past: &[EpochMetrics]) -> std::result::Result<(), String> {
        let counts = Counts::deserialize(counts).map_err(|why| format!("its counts: {why}"))?;
        let last = past.last().ok_or("it holds no epoch")?;
        self.descent.restore(tensors, &counts, (last.updates, last.get("skipped_updates") as u64))
    }

    fn remedy(&self, _tensor: &str) -> (&'static str, &'static str) {
        ("the policy", "lower train.learning_rate")
    }

    fn finish(self: Box<Self>) -> (Policy, Option<Dynamics>) {
        (self.descent.policy, None)
    }
}

/// Learns from the datasets of `make all`, or of `hilt convert`, and writes what `hilt evaluate --policy` runs.
fn train(dataset: &Path, policy: &Path, settings: &TrainSettings, seed: u64, hooks: Hooks) -> Result<Trained> {
    let [train, validation] = ["train", "validation"].map(|name| dataset::read(&dataset.join(name)));
    let (train, validation) = (train?, validation?);
    let method = Huber::new(Inputs::new(train.demos, validation.demos)?, settings, seed)?;
    let trained = run(Box::new(method), settings, hooks)?;
    let mut made = Provenance { stage: "train".into(), seed, ..train.provenance }; // it says which robot and task
    (made.settings["train"], made.settings["method"]) = (json!(settings), HUBER.into());
    weights::write(policy, weights::POLICY, &trained.policy.to_tensors(), &trained.policy.meta(), &made)?;
    Ok(trained)
}

// --- the tests: docs/add-a-method.md ends above -----------------------------------------------------------------------------------

use assert_cmd::Command;
use hilt::learn::Checkpoint;
use hilt::learn::models::Corpus;
use hilt::table::Values;
use std::fs;
use std::time::Duration;

/// The only demo of the fixture, to learn from and to be judged on.
const DATASET: &str = "fixtures/pick-up/dataset/validation";
const SEED: u64 = 5;

fn inputs() -> Inputs {
    let demos = dataset::read(Path::new(DATASET)).expect("the fixture").demos;
    Inputs::new(demos.clone(), demos).expect("demos")
}

fn quick(epochs: u64) -> TrainSettings {
    TrainSettings { hidden_layers: 2, hidden_units: 16, bc_batch: 32, epochs, learning_rate: 3e-3, ..Default::default() }
}

fn learn(settings: &TrainSettings, hooks: Hooks) -> Result<Trained> {
    run(Box::new(Huber::new(inputs(), settings, SEED)?), settings, hooks)
}

fn column(trained: &Trained, name: &str) -> Vec<f64> {
    let column = trained.metrics.columns.iter().find(|column| column.name == name).expect("a column");
    let Values::F64(values) = &column.values else { panic!("{name} holds numbers") };
    values.clone()
}

/// All bits of the results.
fn bits(trained: &Trained) -> (Vec<u32>, Vec<u64>) {
    let numbers = METRICS.iter().flat_map(|metric| column(trained, metric.name));
    let weights = trained.policy.to_tensors().into_iter().flat_map(|tensor| tensor.data);
    (weights.map(f32::to_bits).collect(), numbers.map(f64::to_bits).collect())
}

/// As a file would give it back.
fn reread(checkpoint: &Checkpoint) -> Checkpoint {
    let meta = serde_json::from_str(&checkpoint.meta.to_string()).expect("JSON");
    Checkpoint { tensors: checkpoint.tensors.clone(), meta }
}

#[test]
fn the_page_is_the_code_of_this_file_and_names_every_place_that_names_a_method() {
    let (page, code) = (fs::read_to_string("docs/add-a-method.md").expect("the page"), include_str!("methods.rs"));
    let blocks: Vec<&str> = page.split("```rust\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert_eq!(blocks.len(), 1);
    assert!(code.contains(blocks[0]), "docs/add-a-method.md and tests/methods.rs have come apart");
    let mut files = vec!["Makefile".into(), "pipelines/made.sh".into(), "README.md".into()];
    let mut dirs = vec![Path::new("src").to_path_buf()];
    while let Some(dir) = dirs.pop() {
        for entry in fs::read_dir(dir).expect("a directory") {
            let path = entry.expect("an entry").path();
            if path.is_dir() { dirs.push(path) } else { files.push(path) }
        }
    }
    for path in files.iter().filter(|path| !path.starts_with("src/learn/methods/bc_rl")) {
        let text = fs::read_to_string(path).expect("a text");
        let named = ["BcRl", "bc-rl", "bc_rl"].iter().any(|name| text.contains(name));
        assert!(!named || page.contains(&format!("`{}`", path.display())), "the page does not name {}", path.display());
    }
    for path in page.split('`').filter(|word| word.starts_with("src/") || word.starts_with("tests/")) {
        assert!(Path::new(path).exists(), "{path} is not there any more");
    }
}

#[test]
fn its_gradient_equals_finite_differences() {
    let Inputs { train: corpus, .. } = inputs();
    let policy = Policy::new(&corpus, &quick(1), &mut stream(SEED, "train.init", 0));
    let rows: Vec<usize> = (0..corpus.rows()).step_by(5).collect();
    let loss_of = |corpus: &Corpus, policy: &Policy, gradient: Option<&mut Vec<f32>>| {
        let (mut acted, mut loss) = (Acted::default(), PolicyLoss::new("", corpus.layout.action_dim(), rows.len()));
        let value = huber(PolicySamples { corpus, policy }, &rows, &mut acted, &mut loss).expect("finite");
        gradient.into_iter().for_each(|gradient| acted.gradient(policy, 1.0 * &loss, gradient));
        value
    };
    let tensors = policy.to_tensors();
    let layers = || tensors.iter().enumerate().filter(|(_, tensor)| tensor.name.starts_with("policy.layer_"));
    let places: Vec<(usize, usize)> = layers().flat_map(|(t, tensor)| (0..tensor.data.len()).map(move |i| (t, i))).collect();
    let mut gradient = vec![0.0; places.len()];
    loss_of(&corpus, &policy, Some(&mut gradient));
    let largest = gradient.iter().fold(0.0f32, |most, d| most.max(d.abs()));
    assert!(largest > 1e-3, "{largest}");
    for (k, (t, i)) in places.into_iter().enumerate().step_by(17) {
        let at = |by: f32| {
            let mut moved = tensors.clone();
            moved[t].data[i] += by;
            loss_of(&corpus, &Policy::from_tensors(&moved, &policy.meta()).expect("a policy"), None)
        };
        let numeric = (at(1e-2) - at(-1e-2)) / 2e-2;
        let off = (numeric - f64::from(gradient[k])).abs();
        assert!(off < 0.02 * f64::from(largest), "parameter {k}: {} against {numeric}", gradient[k]);
    }
}

#[test]
fn from_every_epoch_on_it_ends_with_the_same_bits_also_when_it_was_interrupted() {
    let (settings, go, mut checkpoints) = (quick(5), Interrupt::default(), Vec::new());
    let keep = Box::new(|checkpoint: &Checkpoint| checkpoints.push(reread(checkpoint)));
    let whole = learn(&settings, Hooks { keep, keep_every: Some(Duration::ZERO), ..Hooks::new(&go) }).expect("trains");
    let (stop, mut last) = (Interrupt::default(), None);
    let log = Box::new(|row: &EpochMetrics, _: &'static [Metric]| {
        if row.epoch == 2 {
            stop.raise(15)
        }
    });
    let keep = Box::new(|checkpoint: &Checkpoint| last = Some(reread(checkpoint)));
    let interrupted = learn(&settings, Hooks { log, keep, ..Hooks::new(&stop) });
    assert!(matches!(interrupted, Err(Error::Interrupted)));
    let last = last.expect("the last good state is kept");
    assert_eq!((last.after(), checkpoints.len()), ("huber epoch 2 of 5", 5));
    for resume in checkpoints.into_iter().chain([last]) {
        let after = resume.after().to_string();
        let resumed = learn(&settings, Hooks { resume: Some(resume), ..Hooks::new(&go) }).expect("goes on");
        assert!(bits(&resumed) == bits(&whole), "after {after}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    // Enough rows for several shards.
    let settings = TrainSettings { bc_batch: 160, ..quick(5) };
    let demos = vec![dataset::read(Path::new(DATASET)).expect("the fixture").demos[0].clone(); 4];
    let learn = || {
        let method = Huber::new(Inputs::new(&demos, &demos)?, &settings, SEED)?;
        assert!(method.inputs.train.rows() >= settings.bc_batch);
        run(Box::new(method), &settings, Hooks::new(&Interrupt::default()))
    };
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| bits(&learn().expect("trains")))
    });
    assert!(one == three);
}

#[test]
fn it_learns_and_hilt_evaluates_its_policy() {
    let dir = tempfile::tempdir().expect("a directory");
    let from = fs::canonicalize(DATASET).expect("the fixture");
    ["train", "validation"].iter().for_each(|name| std::os::unix::fs::symlink(&from, dir.path().join(name)).expect("a link"));
    let policy = dir.path().join("policy-huber.safetensors");
    let trained = train(dir.path(), &policy, &quick(60), SEED, Hooks::new(&Interrupt::default())).expect("trains");
    for name in ["l_huber", "validation_l_huber"] {
        let loss = column(&trained, name);
        assert!(loss[59] < 0.25 * loss[0], "{name} from {} to {}", loss[0], loss[59]);
    }
    let mut evaluate = Command::cargo_bin("hilt").expect("the binary");
    evaluate.args(["evaluate", "--quiet", "--pipeline", "fixtures/pick-up.toml", "--episodes", "1", "--policy"]).arg(&policy);
    evaluate.arg("--out").arg(dir.path().join("evaluation.json")).assert().success();
}
