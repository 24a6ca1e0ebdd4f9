//! The chain of stages for one cell of a study: demos, dynamics, policies in equal time, evaluation.

use crate::lab::{Done, Lab, OUT, Setup};
use crate::results::Row;
use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use hilt::config::Stage;
use hilt::data::{dataset, json_file, table_file};
use hilt::eval::Summary;
use hilt::experiment::results;
use std::path::Path;

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Method {
    Bc,
    Sc,
    Hil,
}

impl Method {
    /// As `hilt train --method` takes it.
    pub fn name(self) -> &'static str {
        ["bc", "sc", "hil"][self as usize]
    }
}

/// Processor times of two methods count as equal within this share.
const EQUAL_TIME: f64 = 0.05;
/// Trainings to come within that; with none, the nearest is taken.
const ATTEMPTS: usize = 5;
/// Length of the first training, which measures the rate: updates of BC, epochs of SC.
const BC_PROBE: u64 = 1000;
const SC_PROBE: u64 = 5;

/// Training as long as more of it still helps somebody: methods are compared at their best, and what is enough for the ordinary tasks is
/// not enough with few demos. `--set` overrides it.
pub const THOROUGH: [&str; 4] =
    ["pretrain.patience=0", "train.warm_start_updates=15000", "train.epochs=60", "train.min_updates=2000"];

/// A trained policy and what it cost.
#[derive(Clone, Debug)]
pub struct Trained {
    pub method: Method,
    pub policy: Done,
    /// Processor time of the dynamics network, where the method uses one \[s\].
    pub pretrain_s: f64,
    /// Wall time of pretraining and training \[s\].
    pub wall_s: f64,
    /// Updates of the policy, warm start included.
    pub updates: u64,
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|w| w.to_string()).collect()
}

fn input(done: &Done, name: &str) -> String {
    done.dir.join(name).display().to_string()
}

fn own(name: &str) -> String {
    format!("{OUT}/{name}")
}

impl Lab {
    /// Plans, recordings and datasets; refuses when there are fewer demos than `convert.demos`.
    pub fn demos(&self, label: &str, setup: &Setup) -> Result<Done> {
        let stages = [
            (Stage::Plan, words(&["--out", &own("plans.parquet")])),
            (Stage::Simulate, words(&["--plans", &own("plans.parquet"), "--out", &own("recordings")])),
            (Stage::Convert, words(&["--recordings", &own("recordings"), "--out", &own("dataset")])),
        ];
        let done = self.step(&format!("{label}-demos"), setup, &stages, &["plans.parquet", "recordings"])?;
        let wanted = setup.resolve()?.convert.demos;
        let parts = [dataset::TRAIN, dataset::VALIDATION].map(|part| episodes(&done.dir.join("dataset").join(part)));
        let made: u64 = parts.into_iter().sum::<Result<u64>>()?;
        ensure!(wanted == 0 || made == wanted, "{label}: {made} demos instead of {wanted}: raise plan.episodes");
        Ok(done)
    }

    /// One network for all policies of these demos, whatever the policies see.
    fn pretrain(&self, setup: &Setup, demos: &Done) -> Result<Done> {
        let flags = words(&["--dataset", &input(demos, "dataset"), "--out", &own("dynamics.safetensors")]);
        self.step(&format!("{}-dynamics", demos.label), setup, &[(Stage::Pretrain, flags)], &[])
    }

    fn train(&self, label: &str, setup: &Setup, method: Method, demos: &Done, model: Option<&Done>) -> Result<Done> {
        let mut flags = words(&["--method", method.name(), "--dataset", &input(demos, "dataset")]);
        if let Some(model) = model {
            flags.extend(["--dynamics".into(), input(model, "dynamics.safetensors")]);
        }
        flags.extend(["--out".into(), own("policy.safetensors")]);
        self.step(&format!("{label}-{}", method.name()), setup, &[(Stage::Train, flags)], &[])
    }

    /// HIL as the settings say; BC and SC on the same demos for the time that HIL took with its dynamics network. SC needs that
    /// network too; BC does not, and gets the time for itself.
    pub fn in_equal_time(
        &self,
        label: &str,
        setup: &Setup,
        hil_sets: &[String],
        methods: &[Method],
        demos: &Done,
    ) -> Result<Vec<Trained>> {
        let hil_setup = setup.with(hil_sets);
        let model = self.pretrain(&hil_setup, demos)?;
        let hil = self.train(label, &hil_setup, Method::Hil, demos, Some(&model))?;
        let one = |method: &Method| -> Result<Trained> {
            let with_model = |policy: Done| (model.cpu_s, model.wall_s + policy.wall_s, policy);
            let (pretrain_s, wall_s, policy) = match method {
                Method::Hil => with_model(hil.clone()),
                Method::Bc => {
                    let policy = fill(model.cpu_s + hil.cpu_s, BC_PROBE, |updates| {
                        let sets = [format!("train.warm_start_updates={updates}"), "train.epochs=0".into()];
                        self.train(label, &setup.with(&sets), Method::Bc, demos, None)
                    })?;
                    (0.0, policy.wall_s, policy)
                }
                Method::Sc => with_model(fill(hil.cpu_s, SC_PROBE, |epochs| {
                    let sets = [format!("train.epochs={epochs}"), "train.min_updates=0".into()];
                    self.train(label, &setup.with(&sets), Method::Sc, demos, Some(&model))
                })?),
            };
            Ok(Trained { method: *method, updates: updates(&policy)?, policy, pretrain_s, wall_s })
        };
        methods.iter().map(one).collect()
    }

    /// HIL alone.
    pub fn hil(&self, label: &str, setup: &Setup, hil_sets: &[String], demos: &Done) -> Result<Trained> {
        let mut trained = self.in_equal_time(label, setup, hil_sets, &[Method::Hil], demos)?;
        trained.pop().context("one method was asked for")
    }

    /// Evaluates on unseen episodes; a row of results.
    pub fn evaluate(&self, label: &str, setup: &Setup, labels: &[(&str, String)], trained: &Trained) -> Result<Row> {
        let policy = input(&trained.policy, "policy.safetensors");
        let flags = words(&["--policy", &policy, "--out", &own("evaluation.json")]);
        let label = format!("{label}-{}-evaluation", trained.method.name());
        let done = self.step(&label, setup, &[(Stage::Evaluate, flags)], &[])?;
        let path = done.dir.join("evaluation.json");
        let (content, _) = json_file::read(&path)?;
        let summary: Summary = serde_json::from_value(content).with_context(|| format!("{} is no summary", path.display()))?;
        Ok(Row::of(labels, setup.seed, trained, &summary))
    }
}

/// Trains for `seconds` of processor time: a short training measures the rate, each further one corrects it.
fn fill(seconds: f64, probe: u64, train: impl Fn(u64) -> Result<Done>) -> Result<Done> {
    let (mut length, mut nearest) = (probe, None::<Done>);
    let off = |done: &Done| (done.cpu_s / seconds - 1.0).abs();
    for _ in 0..ATTEMPTS {
        let done = train(length)?;
        length = (length as f64 * seconds / done.cpu_s).round().max(1.0) as u64;
        if nearest.as_ref().is_none_or(|n| off(&done) < off(n)) {
            nearest = Some(done);
        }
        if nearest.as_ref().is_some_and(|n| off(n) <= EQUAL_TIME) {
            break;
        }
    }
    nearest.context("there is at least one attempt")
}

/// Episodes of a dataset, by its own count.
fn episodes(root: &Path) -> Result<u64> {
    let path = root.join("meta/info.json");
    let info: serde_json::Value = serde_json::from_slice(&std::fs::read(&path)?)?;
    info["total_episodes"].as_u64().with_context(|| format!("{} does not count its episodes", path.display()))
}

/// Updates of all stages of a training.
fn updates(policy: &Done) -> Result<u64> {
    let (table, _) = table_file::read(&policy.dir.join("policy.training.parquet"))?;
    results::updates(&table).with_context(|| format!("{}: policy.training.parquet counts no updates", policy.dir.display()))
}
