//! Proximal policy optimisation on a toy world whose optimum is known, and its gradients against finite differences.

use super::group::Record;
use super::objective::{Choices, Work};
use super::toy::{GAMMA, Regulator, best_gain, cost, layout};
use super::*;
use crate::config::{FeatureSet, PpoSettings, TrainSettings};
use crate::env::Env;
use crate::layout::Layout;
use crate::learn::models::Reader;
use crate::learn::tests::testing::Toy;
use crate::math::exp;
use crate::nn::Lanes;
use std::sync::Arc;

fn settings() -> TrainSettings {
    let ppo = PpoSettings {
        total_steps: 64_000,
        worlds: 16,
        steps: 32,
        gamma: GAMMA,
        minibatch: 128,
        learning_rate: 2e-3,
        final_learning_rate: 1e-4,
        action_unit: 1.0,
        ..Default::default()
    };
    TrainSettings { hidden_layers: 2, hidden_units: 32, features: FeatureSet::Raw, ppo, ..Default::default() }
}

fn toy(settings: &TrainSettings) -> Ppo {
    Ppo::new(&layout(), settings, 11, |_| Ok(Box::new(Regulator::new(11)))).expect("worlds")
}

#[test]
fn it_finds_the_known_optimum_of_a_regulator() {
    let settings = settings();
    let mut ppo = toy(&settings);
    while ppo.iteration < settings.ppo.iterations() {
        ppo.iteration(&|| Ok(()), &mut Lesson::Both(None)).expect("an iteration");
    }
    let gain = best_gain() as f32;
    let best = cost(|seen| [-gain * seen[0], -gain * seen[1]]);
    let nothing = cost(|_| [0.0; 2]);
    let learned = cost(|seen| {
        let action = ppo.policy.act(seen);
        [action[0], action[1]]
    });
    println!("cost: {learned} learned, {best} at best, {nothing} without moving");
    assert!(best < 0.5 * nothing && best <= learned, "no learning is needed: {best} against {nothing}");
    assert!(learned < best + 0.03 * (nothing - best), "{learned} learned, {best} at best, {nothing} without moving");
}

/// Everything that a run leaves, as text.
fn left_by(ppo: &Ppo, metrics: &[Row]) -> String {
    let (tensors, meta) = ppo.save();
    let bits = |tensor: &crate::tensor::NamedTensor| tensor.data.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    let values: Vec<u64> = metrics.iter().flatten().map(|value| value.to_bits()).collect();
    format!("{values:?} {meta} {:?}", tensors.iter().map(bits).collect::<Vec<_>>())
}

fn go_on(ppo: &mut Ppo, iterations: u64) -> Vec<Row> {
    (0..iterations).map(|_| ppo.iteration(&|| Ok(()), &mut Lesson::Both(None)).expect("an iteration")).collect()
}

#[test]
fn passes_end_where_the_policy_has_moved_too_far() {
    let updates = |target_kl: f64| {
        let mut settings = settings();
        settings.ppo.target_kl = target_kl;
        let mut ppo = toy(&settings);
        go_on(&mut ppo, 2);
        ppo.updates
    };
    let [never, soon] = [0.0, 1e-7].map(updates);
    // 16 worlds of 32 steps in batches of 128, in each pass.
    let most = 2 * settings().ppo.epochs * 16 * 32 / 128;
    assert!(never == most && (2..most / 2).contains(&soon), "{soon} updates of {never}, of {most}");
}

#[test]
fn threads_and_a_break_change_no_bit() {
    let settings = settings();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut ppo = toy(&settings);
            let metrics = go_on(&mut ppo, 3);
            left_by(&ppo, &metrics)
        })
    };
    let whole = with(1);
    assert_eq!(whole, with(3));

    let mut first = toy(&settings);
    let mut metrics = go_on(&mut first, 2);
    let (tensors, meta) = first.save();
    let meta = serde_json::from_str(&meta.to_string()).expect("what was written");
    let mut second = toy(&settings);
    second.restore(&Reader { tensors: &tensors, meta: &meta }).expect("a checkpoint of the same run");
    assert_eq!(second.steps(), 2 * settings.ppo.batch());
    metrics.extend(go_on(&mut second, 1));
    assert_eq!(whole, left_by(&second, &metrics));
}

#[test]
fn a_checkpoint_that_does_not_fit_is_refused() {
    let settings = settings();
    let mut ppo = toy(&settings);
    go_on(&mut ppo, 1);
    let (tensors, meta) = ppo.save();
    let said = |change: &dyn Fn(&mut Vec<crate::tensor::NamedTensor>, &mut serde_json::Value)| {
        let (mut tensors, mut meta) = (tensors.clone(), meta.clone());
        change(&mut tensors, &mut meta);
        toy(&settings).restore(&Reader { tensors: &tensors, meta: &meta }).expect_err("refused")
    };
    assert!(said(&|tensors, _| tensors.truncate(2)).contains("policy.net.first_moment is missing"));
    assert!(said(&|_, meta| meta["worlds"] = serde_json::json!([])).contains("0 worlds, this run 16"));
    assert!(said(&|_, meta| meta["worlds"][3]["steps"] = 1000.into()).contains("step 1000"));
    assert!(said(&|_, meta| meta["worlds"][3]["begun"] = u64::MAX.into()).contains("episodes of a world"));
    assert!(said(&|_, meta| meta["adam_steps"][2] = u32::MAX.into()).contains("steps of an optimiser"));
    assert!(said(&|_, meta| meta["statistics"]["squares"][0] = (-1.0).into()).contains("statistics"));
}

#[test]
fn worlds_of_another_task_and_settings_out_of_range_are_refused() {
    let make = |_| -> Result<Box<dyn Env>> { Ok(Box::new(Regulator::new(0))) };
    let refused =
        |layout: &Arc<Layout>, settings: &TrainSettings| Ppo::new(layout, settings, 0, make).err().expect("refused").to_string();
    assert!(refused(&Toy::Stack.layout(), &settings()).contains("shows 2 numbers"));
    let mut odd = settings();
    odd.ppo.worlds = 20;
    assert!(refused(&layout(), &odd).contains("multiple of 8"));
    let stopped = toy(&settings()).iteration(&|| Err(Error::Interrupted), &mut Lesson::Both(None));
    assert!(matches!(stopped, Err(Error::Interrupted)));
}

/// What [`Work::look`] says the objective is, the entropy included.
fn objective(ppo: &Ppo, records: &[Record], panels: &[(usize, usize)], choices: Choices) -> [f64; 2] {
    let seen = Work::default().look(&ppo.policy, &ppo.value, records, panels, choices);
    let entropy: f64 = ppo.policy.log_std.iter().map(|l| f64::from(*l)).sum();
    [seen.policy_loss - f64::from(choices.entropy) * entropy, seen.value_loss]
}

#[test]
fn gradients_equal_finite_differences() {
    let mut settings = settings();
    (settings.ppo.steps, settings.ppo.epochs, settings.ppo.target_kl) = (12, 1, 0.0);
    let mut ppo = toy(&settings);
    // Wide enough that few ratios stand at the clip's edge, where there is no gradient.
    let choices = Choices { clip: 0.3, entropy: 0.01 };
    go_on(&mut ppo, 2);
    let records = std::mem::take(&mut ppo.records);
    let panels: Vec<(usize, usize)> = (0..2).flat_map(|g| (0..12).map(move |t| (g, t))).collect();
    let mut work = Work::default();
    work.look(&ppo.policy, &ppo.value, &records, &panels, choices);
    let h = 3e-3f32;
    let mut compare = |what: &str, analytic: f32, term: usize, set: &dyn Fn(&mut Ppo, f32)| {
        let mut at = |step: f32| {
            set(&mut ppo, step);
            let found = objective(&ppo, &records, &panels, choices)[term];
            set(&mut ppo, -step);
            found
        };
        let numeric = (at(h) - at(-h)) / f64::from(2.0 * h);
        let error = (numeric - f64::from(analytic)).abs();
        assert!(error < 2e-3 + 0.05 * numeric.abs(), "{what}: {analytic} against {numeric}");
        analytic.abs()
    };
    let (mut largest, len) = ([0.0f32; 3], work.d_policy.len());
    for i in (0..len).step_by(len / 40).chain(len - 2..len) {
        let moved = compare("policy", work.d_policy[i], 0, &|ppo, h| ppo.policy.net.params_mut()[i] += h);
        largest[0] = largest[0].max(moved);
    }
    for i in 0..2 {
        largest[1] = largest[1].max(compare("log_std", work.d_log_std[i], 0, &|ppo, h| ppo.policy.log_std[i] += h));
    }
    let len = work.d_value.len();
    for i in (0..len).step_by(len / 40).chain([len - 1]) {
        largest[2] = largest[2].max(compare("value", work.d_value[i], 1, &|ppo, h| ppo.value.params_mut()[i] += h));
    }
    assert!(largest.iter().all(|d| *d > 0.02), "gradients that are all nearly 0 show nothing: {largest:?}");
}

/// By hand, on one row: inside the clip the slope is that of the ratio, beyond it there is none.
#[test]
fn an_action_that_has_earned_enough_teaches_no_more() {
    let mut settings = settings();
    settings.ppo.steps = 1;
    let mut ppo = toy(&settings);
    ppo.act(&|| Ok(())).expect("a step");
    let records = &mut ppo.records;
    let choices = Choices { clip: 0.2, entropy: 0.0 };
    for record in records.iter_mut() {
        record.advantages[0] = Lanes::splat(1.0);
        // The policy gives these actions e^0.5 times the probability that they had.
        record.log_prob[0] = record.log_prob[0] - Lanes::splat(0.5);
    }
    let mut work = Work::default();
    let seen = work.look(&ppo.policy, &ppo.value, records, &[(0, 0), (1, 0)], choices);
    assert!((seen.policy_loss + 1.2).abs() < 1e-5 && seen.clipped > 0.999, "{seen:?}");
    assert!((seen.kl - (exp(0.5) - 1.5)).abs() < 1e-4, "{seen:?}");
    assert!(work.d_policy.iter().all(|d| *d == 0.0) && work.d_log_std == [0.0; 2]);
    for record in records.iter_mut() {
        record.advantages[0] = Lanes::splat(-1.0);
    }
    let seen = work.look(&ppo.policy, &ppo.value, records, &[(0, 0), (1, 0)], choices);
    assert!((seen.policy_loss - exp(0.5)).abs() < 1e-4, "{seen:?}");
    assert!(work.d_policy.iter().any(|d| *d != 0.0), "an action that is too likely goes on to teach");
}
