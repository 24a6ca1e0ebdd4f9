//! L_RL + lambda L_BC on toy demos and a toy world.

use super::*;
use crate::config::FeatureSet;
use crate::learn::methods::ppo::toy::{GAMMA, Regulator, demos, layout};
use crate::learn::models::{Corpus, Policy, Reader};
use crate::learn::run::{Checkpoint, Hooks, Method, run};

fn settings() -> TrainSettings {
    let ppo = PpoSettings { total_steps: 6 * 128, worlds: 16, steps: 8, gamma: GAMMA, minibatch: 64, ..Default::default() };
    TrainSettings {
        hidden_layers: 2,
        hidden_units: 16,
        features: FeatureSet::Raw,
        warm_start_updates: 20.into(),
        bc_batch: 64,
        epochs: 1,
        min_updates: 0,
        ppo,
        bc_rl: BcRlSettings { lambda: 0.4, lambda_decay: 0.5, value_iterations: 2, ..Default::default() },
        ..Default::default()
    }
}

fn toy(settings: &TrainSettings) -> BcRl {
    let (train, held_out) = (demos(6, 30), demos(2, 20));
    let inputs = Inputs::new(train, held_out).expect("demos");
    BcRl::new(inputs, settings, 7, |_| Ok(Box::new(Regulator::new(11)))).expect("worlds")
}

#[test]
fn what_is_added_is_lambda_times_the_gradient_of_l_bc() {
    let (settings, lambda) = (settings(), 0.7);
    let corpus = Corpus::new(demos(6, 30), "training").expect("demos");
    let mut policy = Policy::new(&corpus, &settings, &mut stream(3, "bc-rl test", 0));
    let l_bc = |policy: &Policy, gradient: &mut [f32]| {
        let drawn = &mut stream(5, "bc-rl test", 0);
        Demos::new(&settings, &layout()).add_gradient(policy, &corpus, lambda, drawn, gradient).expect("a loss")
    };
    let len = policy.net.params().len();
    // What stands there already, of the clipped objective, stays in the sum.
    let mut gradient = vec![2.0f32; len];
    l_bc(&policy, &mut gradient);
    let (h, mut largest) = (1e-2f32, 0.0f32);
    for i in (0..len).step_by(len / 60).chain(len - 2..len) {
        let mut at = |step: f32| {
            policy.net.params_mut()[i] += step;
            let loss = l_bc(&policy, &mut vec![0.0; len]);
            policy.net.params_mut()[i] -= step;
            loss
        };
        let (numeric, analytic) = (lambda * (at(h) - at(-h)) / f64::from(2.0 * h), gradient[i] - 2.0);
        assert!((numeric - f64::from(analytic)).abs() < 1e-4 + 0.03 * numeric.abs(), "{i}: {analytic} against {numeric}");
        largest = largest.max(analytic.abs());
    }
    assert!(largest > 0.01, "gradients that are all nearly 0 show nothing: {largest}");
}

#[test]
fn lambda_decays_once_the_value_network_has_had_its_iterations() {
    let toy = toy(&settings());
    assert_eq!([0, 1, 2, 3, 4].map(|iteration| toy.lambda(iteration)), [None, None, Some(0.4), Some(0.2), Some(0.1)]);
}

#[test]
fn the_cloned_policy_stays_what_it_was_until_the_value_network_has_learned() {
    let settings = settings();
    let (mut method, interrupt) = (toy(&settings), Interrupt::default());
    let (mut cloned, mut changed) = (Vec::new(), Vec::new());
    for stage in method.stages() {
        method.begin(stage.name);
        for epoch in 0..stage.epochs {
            let row = method.epoch(stage, epoch, &interrupt).expect("an epoch");
            if stage.name == BC_RL {
                changed.push(method.candidate().net.params() != cloned);
                assert_eq!(row.get("lambda").is_nan(), epoch < 2);
            }
        }
        method.end(stage.name);
        if stage.name != BC_RL {
            cloned = method.candidate().net.params().to_vec();
        }
    }
    // As behavior cloning leaves it: the averaged weights.
    assert_eq!(changed, [false, false, true, true, true, true]);
}

/// The bits of everything that a run leaves, and its last checkpoint, when it is stopped after so many epochs.
fn left_by(threads: usize, stop_after: Option<usize>, resume: Option<Checkpoint>) -> (Vec<u32>, Option<Checkpoint>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        let (settings, interrupt) = (settings(), Interrupt::default());
        let (mut kept, mut epochs) = (None, 0);
        let mut hooks = Hooks::new(&interrupt);
        hooks.resume = resume;
        hooks.keep = Box::new(|checkpoint| kept = Some(checkpoint.clone()));
        hooks.log = Box::new(|_, _| {
            epochs += 1;
            if Some(epochs) == stop_after {
                interrupt.raise(2);
            }
        });
        let trained = run(Box::new(toy(&settings)), &settings, hooks);
        let bits = trained.map(|t| t.policy.to_tensors().into_iter().flat_map(|t| t.data).map(f32::to_bits).collect());
        (bits.unwrap_or_default(), kept)
    })
}

#[test]
fn threads_and_a_break_in_any_epoch_change_no_bit() {
    let (whole, _) = left_by(1, None, None);
    assert!(!whole.is_empty());
    assert_eq!(whole, left_by(3, None, None).0);
    let epochs: u64 = toy(&settings()).stages().iter().map(|stage| stage.epochs).sum();
    for stop_after in 1..epochs as usize {
        let (nothing, kept) = left_by(2, Some(stop_after), None);
        assert!(nothing.is_empty() && kept.is_some(), "it was not stopped after {stop_after} epochs");
        assert_eq!(whole, left_by(2, None, kept).0, "stopped after {stop_after} epochs");
    }
}

#[test]
fn a_checkpoint_of_running_statistics_is_refused() {
    let mut toy = toy(&settings());
    toy.begin(BC_RL);
    let row = toy.epoch(*toy.stages().last().expect("a stage"), 0, &Interrupt::default()).expect("an iteration");
    let saved = toy.save();
    let mut counts = saved.counts.clone();
    counts["statistics"] = serde_json::json!({ "count": 1.0, "mean": vec![0.0; 25], "squares": vec![0.0; 25] });
    let refused = toy.restore(&counts, &Reader { tensors: &saved.tensors, meta: &counts }, &[row]).expect_err("refused");
    assert!(refused.contains("statistics"), "{refused}");
}
