//! Training that stops and goes on, and the choice of a model, on toy demos.

use super::testing::{Toy, demos};
use crate::config::{Alpha, PretrainSettings, RandomiseSettings, ScSettings, TrainSettings};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::learn::{Checkpoint, Dynamics, Hooks, Inputs, MethodName as Method, Policy, Trained, pretrain_dynamics, train};
use crate::table::Values;
use serde_json::Value;
use std::time::Duration;

fn dynamics() -> Dynamics {
    let settings = PretrainSettings { hidden_units: 16, epochs: 1, batch_rows: 64, ..Default::default() };
    let (train, held_out) = (demos(Toy::Stack, 8, 30, 0), demos(Toy::Stack, 2, 30, 100));
    pretrain_dynamics(&train, &held_out, &settings, 0, &mut |_, _| {}, &Interrupt::default()).expect("pretrains").0
}

fn quick() -> TrainSettings {
    TrainSettings {
        hidden_units: 16,
        hidden_layers: 2,
        warm_start_updates: 10.into(),
        bc_batch: 64,
        epochs: 3,
        min_updates: 0,
        batch: 3,
        select_candidates: 3,
        ..Default::default()
    }
}

fn run(method: Method, settings: &TrainSettings, hooks: Hooks) -> Result<Trained> {
    let (demos, held_out) = (demos(Toy::Stack, 8, 30, 0), demos(Toy::Stack, 2, 30, 100));
    let model = (method != Method::Bc).then(dynamics);
    train(method, Inputs::new(&demos, &held_out)?, model, settings, 7, hooks)
}

/// All bits of the results.
fn bits(trained: &Trained) -> (Vec<u32>, Vec<u64>, String) {
    let networks = trained.policy.to_tensors().into_iter().chain(trained.dynamics.iter().flat_map(Dynamics::to_tensors));
    let floats = |values: &Values| match values {
        Values::F64(v) => v.iter().map(|x| x.to_bits()).collect(),
        Values::I64(v) => v.iter().map(|x| *x as u64).collect(),
        _ => Vec::new(),
    };
    let metrics = trained.metrics.columns.iter().flat_map(|c| floats(&c.values)).collect();
    (networks.flat_map(|t| t.data).map(f32::to_bits).collect(), metrics, format!("{:?}", trained.selection))
}

/// A score that depends on the weights alone.
fn score(policy: &Policy) -> Result<u64> {
    Ok(u64::from(policy.net.params()[0].to_bits()) % 100)
}

/// As a file would give it back.
fn reread(checkpoint: &Checkpoint) -> Checkpoint {
    let meta: Value = serde_json::from_str(&checkpoint.meta.to_string()).expect("JSON");
    Checkpoint { tensors: checkpoint.tensors.clone(), meta }
}

#[test]
fn from_every_epoch_on_training_ends_with_the_same_bits() {
    let go = Interrupt::default();
    for (method, settings) in [
        (Method::Hil, quick()),
        (Method::Hil, TrainSettings { select_episodes: 5, sc: ScSettings { balance: true, ..Default::default() }, ..quick() }),
        (Method::Bc, TrainSettings { select_episodes: 5, ..quick() }),
        (Method::Hil, TrainSettings { randomise: RandomiseSettings { fingers_rad: 0.1, objects_rad: 0.1 }, ..quick() }),
        (Method::Sc, TrainSettings { clip_norm: 0.0, ..quick() }),
        (Method::Hil, TrainSettings { warm_start_updates: 0.into(), alpha: Alpha::Fixed(0.5), ..quick() }),
    ] {
        let mut checkpoints = Vec::new();
        let keep = Box::new(|checkpoint: &Checkpoint| checkpoints.push(reread(checkpoint)));
        let hooks = Hooks { keep, keep_every: Some(Duration::ZERO), score: Box::new(score), ..Hooks::new(&go) };
        let whole = run(method, &settings, hooks).expect("trains");
        assert_eq!(checkpoints.len(), whole.metrics.rows());
        assert_eq!(whole.selection.is_some(), settings.select_episodes > 0);
        for checkpoint in checkpoints {
            let after = checkpoint.after().to_string();
            let hooks = Hooks { resume: Some(checkpoint), score: Box::new(score), ..Hooks::new(&go) };
            let resumed = run(method, &settings, hooks).expect("goes on");
            assert!(bits(&resumed) == bits(&whole), "{method:?} after {after}");
        }
    }
}

#[test]
fn an_interrupted_selection_is_made_up_for() {
    let settings = TrainSettings { select_episodes: 5, ..quick() };
    let go = Interrupt::default();
    let whole = run(Method::Hil, &settings, Hooks { score: Box::new(score), ..Hooks::new(&go) }).expect("trains");
    let mut kept = Vec::new();
    let keep = Box::new(|checkpoint: &Checkpoint| kept.push(reread(checkpoint)));
    let hooks = Hooks { keep, score: Box::new(|_| Err(Error::Interrupted)), ..Hooks::new(&go) };
    assert!(matches!(run(Method::Hil, &settings, hooks), Err(Error::Interrupted)));
    assert_eq!(kept.len(), 1);
    let hooks = Hooks { resume: kept.pop(), score: Box::new(score), ..Hooks::new(&go) };
    assert!(bits(&run(Method::Hil, &settings, hooks).expect("goes on")) == bits(&whole));
}

#[test]
fn the_chosen_policy_is_the_one_that_scored_best() {
    let settings = TrainSettings { select_episodes: 5, ..quick() };
    let (mut seen, go) = (Vec::new(), Interrupt::default());
    let scores = [3, 1, 8, 2, 8, 7];
    let watch = |policy: &Policy| {
        seen.push(policy.clone());
        Ok(scores[seen.len() - 1])
    };
    let trained = run(Method::Hil, &settings, Hooks { score: Box::new(watch), ..Hooks::new(&go) }).expect("trains");
    let selection = trained.selection.expect("stated");
    let successes: Vec<u64> = selection.candidates.iter().map(|c| c.successes).collect();
    assert_eq!((successes, selection.chosen), (scores.to_vec(), 4));
    let best = selection.best().expect("a candidate");
    assert_eq!((best.stage.as_str(), best.epoch), ("hil", 2));
    assert_eq!(trained.policy, seen[4]);
    assert_ne!(trained.policy, seen[5]);

    let without = run(Method::Hil, &quick(), Hooks::new(&go)).expect("trains");
    assert_eq!(without.selection, None);
    assert_eq!(without.policy.net, seen[5].net, "the last candidate is the policy that is kept without a selection");
}

/// The error of a run that fails, and the checkpoint that it leaves.
fn failing(method: Method, settings: &TrainSettings) -> (String, Option<Checkpoint>) {
    let (mut kept, go) = (None, Interrupt::default());
    let hooks = Hooks { keep: Box::new(|checkpoint| kept = Some(checkpoint.clone())), ..Hooks::new(&go) };
    let message = run(method, settings, hooks).expect_err("must fail").to_string();
    (message, kept)
}

#[test]
fn a_loss_that_is_no_number_names_its_term_and_leaves_the_last_good_state() {
    let diverging = TrainSettings { learning_rate: 1e30, clip_norm: 0.0, ..quick() };
    let (message, kept) = failing(Method::Hil, &diverging);
    assert!(
        message.contains("L_BC (Eq. 3)") && message.contains("update") && message.contains("train.learning_rate"),
        "{message}"
    );
    let kept = kept.expect("the warm start was good");
    assert!(kept.after().starts_with("warm-start epoch "), "{}", kept.after());
    assert!(kept.tensors.iter().all(|t| t.data.iter().all(|v| v.is_finite())));

    // One update an epoch: the rollouts do not meet the diverged network before its own loss does.
    let fine_tuning = TrainSettings { dynamics_learning_rate: 1e38, batch: 8, ..quick() };
    let (message, kept) = failing(Method::Hil, &fine_tuning);
    assert!(message.contains("Eq. 6") && message.contains("train.dynamics_learning_rate") && kept.is_some(), "{message}");

    let at_once = TrainSettings { warm_start_learning_rate: 1e30, bc_batch: 8, clip_norm: 0.0, ..quick() };
    let (message, kept) = failing(Method::Bc, &at_once);
    assert!(message.contains("L_BC (Eq. 3)") && kept.is_none(), "{message}");
}

#[test]
fn an_epoch_without_a_usable_gradient_ends_training() {
    let (mut first, go) = (None, Interrupt::default());
    let keep = Box::new(|checkpoint: &Checkpoint| {
        first.get_or_insert_with(|| checkpoint.clone());
    });
    let settings = TrainSettings { clip_norm: 0.0, ..quick() };
    run(Method::Bc, &settings, Hooks { keep, keep_every: Some(Duration::ZERO), ..Hooks::new(&go) }).expect("trains");
    let mut steep = first.expect("kept");
    // A head so large that the loss is still a number, its gradient in the layers below none that Adam could square.
    for name in ["policy.net", "policy.net.average"] {
        let net = steep.tensors.iter_mut().find(|t| t.name == name).expect("a network");
        let head = net.data.len() - (16 + 1) * 9;
        net.data[head..].iter_mut().for_each(|w| *w *= 1e16);
    }
    let message =
        run(Method::Bc, &settings, Hooks { resume: Some(steep), ..Hooks::new(&go) }).expect_err("must fail").to_string();
    assert!(message.contains("gradient of L_BC (Eq. 3)") && message.contains("warm-start epoch 2"), "{message}");
}

#[test]
fn a_checkpoint_that_does_not_fit_is_refused() {
    let (mut kept, go) = (None, Interrupt::default());
    let hooks = Hooks { keep: Box::new(|c| kept = Some(c.clone())), keep_every: Some(Duration::ZERO), ..Hooks::new(&go) };
    run(Method::Bc, &quick(), hooks).expect("trains");
    let kept = kept.expect("kept");
    let refused = |method, settings: &TrainSettings, resume: Checkpoint| {
        run(method, settings, Hooks { resume: Some(resume), ..Hooks::new(&go) }).expect_err("refused").to_string()
    };
    let wider = TrainSettings { hidden_units: 20, ..quick() };
    assert!(refused(Method::Bc, &wider, kept.clone()).contains("policy.net has shape"));
    assert!(refused(Method::Hil, &quick(), kept.clone()).contains("without a dynamics network"));
    let mut cut = kept.clone();
    cut.tensors.remove(0);
    assert!(refused(Method::Bc, &quick(), cut).contains("policy.net is missing"));
    let mut other = kept;
    other.meta["counts"]["descent"]["updates"] = "many".into();
    assert!(refused(Method::Bc, &quick(), other).contains("counts"));
}

#[test]
fn a_checkpoint_of_a_past_that_cannot_be_is_refused_before_training_goes_on() {
    let settings = TrainSettings { select_episodes: 5, ..quick() };
    let (mut kept, go) = (None, Interrupt::default());
    let few = |policy: &Policy| score(policy).map(|n| n % 5);
    let keep = Box::new(|c: &Checkpoint| kept = Some(c.clone()));
    let hooks = Hooks { keep, keep_every: Some(Duration::ZERO), score: Box::new(few), ..Hooks::new(&go) };
    run(Method::Bc, &settings, hooks).expect("trains");
    let kept = kept.expect("kept");
    let last = kept.meta["epochs"].as_array().map_or(0, Vec::len) - 1;
    let huge = Value::from(1_000_000_000_000_000u64);
    let cases: [(String, Value); 14] = [
        ("/epochs".into(), Value::Array(vec![])),
        (format!("/epochs/{last}/epochs"), 0.into()),
        (format!("/epochs/{last}/epoch"), 0.into()),
        (format!("/epochs/{last}/epoch"), huge.clone()),
        (format!("/epochs/{last}/stage"), "pretrain".into()),
        (format!("/epochs/{last}/updates"), huge.clone()),
        (format!("/epochs/{last}/values/skipped_updates"), 1e18.into()),
        ("/epochs/0/values/skipped_updates".into(), 1e15.into()),
        ("/counts/descent/updates".into(), 0.into()),
        ("/counts/draws".into(), u64::MAX.into()),
        ("/counts/descent/net/adam".into(), u32::MAX.into()),
        ("/counts/averages/log_ratio".into(), 1e300.into()),
        ("/selection/chosen".into(), u64::MAX.into()),
        ("/selection/candidates/0/successes".into(), huge.clone()),
    ];
    for (place, value) in cases {
        let mut other = kept.clone();
        *other.meta.pointer_mut(&place).expect("a place") = value;
        let hooks = Hooks { resume: Some(other), score: Box::new(few), ..Hooks::new(&go) };
        let refused = run(Method::Bc, &settings, hooks).map(|_| ()).expect_err(&place).to_string();
        assert!(refused.contains("the checkpoint does not fit"), "{place}: {refused}");
    }
    let mut negative = kept;
    negative.tensors.iter_mut().find(|t| t.name == "policy.net.second_moment").expect("moments").data[0] = -1.0;
    let hooks = Hooks { resume: Some(negative), score: Box::new(few), ..Hooks::new(&go) };
    let refused = run(Method::Bc, &settings, hooks).expect_err("refused").to_string();
    assert!(refused.contains("means of squares"), "{refused}");
}
