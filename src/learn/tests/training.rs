//! Training from end to end on toy demos.

use super::testing::{JOINTS, Toy, demo, demos};
use crate::config::{Alpha, PretrainSettings, TrainSettings};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::learn::methods::Hil;
use crate::learn::{Dynamics, Hooks, Inputs, MethodName as Method, ModelReport, Policy, Trained, pretrain_dynamics, train};
use crate::table::{Column, Values};

fn pretrain(toy: Toy, epochs: u64) -> (Dynamics, ModelReport) {
    let settings = PretrainSettings { hidden_units: 24, epochs, batch_rows: 64, ..Default::default() };
    let (train, held_out) = (demos(toy, 8, 30, 0), demos(toy, 2, 30, 100));
    pretrain_dynamics(&train, &held_out, &settings, 0, &mut |_, _| {}, &Interrupt::default()).expect("pretraining works")
}

fn quick() -> TrainSettings {
    TrainSettings {
        hidden_units: 24,
        hidden_layers: 2,
        warm_start_updates: 30.into(),
        bc_batch: 64,
        epochs: 4,
        min_updates: 0,
        batch: 4,
        ..Default::default()
    }
}

fn run(method: Method, settings: &TrainSettings, dynamics: Option<Dynamics>) -> Result<Trained> {
    let (demos, held_out) = (demos(Toy::Stack, 8, 30, 0), demos(Toy::Stack, 2, 30, 100));
    train(method, Inputs::new(&demos, &held_out)?, dynamics, settings, 7, Hooks::new(&Interrupt::default()))
}

fn bytes(policy: &Policy) -> Vec<u32> {
    policy.to_tensors().iter().flat_map(|t| &t.data).map(|v| v.to_bits()).collect()
}

#[test]
fn pure_cloning_is_the_loop_with_alpha_at_its_ends() {
    let dynamics = pretrain(Toy::Stack, 2).0;
    let fixed = |alpha: f64, warm_start: u64| TrainSettings {
        alpha: Alpha::Fixed(alpha),
        warm_start_updates: warm_start.into(),
        ..quick()
    };
    let policy = |method, settings: &TrainSettings| bytes(&run(method, settings, Some(dynamics.clone())).expect("trains").policy);
    let bc = policy(Method::Bc, &quick());
    assert_eq!(policy(Method::Hil, &fixed(0.0, 30)), bc);
    assert_eq!(bytes(&run(Method::Bc, &quick(), None).expect("needs no dynamics").policy), bc);
    // From scratch, with the warm start's number of updates and learning rate.
    let rate = quick().warm_start_learning_rate;
    let from_scratch = TrainSettings { min_updates: 30, learning_rate: rate, ..fixed(1.0, 0) };
    assert_eq!(policy(Method::Hil, &from_scratch), policy(Method::Sc, &quick()));
    assert_ne!(policy(Method::Hil, &fixed(0.5, 30)), bc);
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        pool.install(|| {
            let (dynamics, report) = pretrain(Toy::Stack, 3);
            let trained = run(Method::Hil, &quick(), Some(dynamics)).expect("trains");
            let model = trained.dynamics.expect("kept").to_tensors();
            (bytes(&trained.policy), model, format!("{report:?}{:?}", trained.metrics))
        })
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn a_toy_is_learned_by_each_method() {
    let (dynamics, report) = pretrain(Toy::Stack, 150);
    let number = |name: &str, row: usize| match &report.errors.column(name).expect("column").values {
        Values::F64(v) => v[row],
        other => panic!("{other:?}"),
    };
    for group in [0, 1] {
        let (network, unchanged) = (number("network_1_step", group), number("unchanged_1_step", group));
        assert!(network < 0.2 * unchanged, "group {group}: {network} against {unchanged}");
        assert!(number("integrated_10_steps", group) < 1e-4, "the toy integrates its commands");
    }
    let settings = TrainSettings { warm_start_updates: 600.into(), epochs: 60, learning_rate: 1e-3, ..quick() };
    let unseen = demo(Toy::Stack, 30, 999);
    let (many, held_out) = (demos(Toy::Stack, 40, 30, 0), demos(Toy::Stack, 2, 30, 100));
    let error = |method: Method, settings: &TrainSettings| -> f64 {
        let go = Interrupt::default();
        let model = Some(dynamics.clone());
        let trained =
            train(method, Inputs::new(&many, &held_out).expect("demos"), model, settings, 7, Hooks::new(&go)).expect("trains");
        let policy = trained.policy;
        let square = |t: usize| -> f64 {
            let label = &unseen.actions()[t * JOINTS..(t + 1) * JOINTS];
            policy.act(unseen.state(t)).iter().zip(label).map(|(a, b)| f64::from(a - b).powi(2)).sum()
        };
        (0..30).map(square).sum::<f64>() / (30 * JOINTS) as f64
    };
    let untrained = error(Method::Bc, &TrainSettings { warm_start_updates: 1.into(), epochs: 0, ..quick() });
    for (method, share) in [(Method::Bc, 0.3), (Method::Hil, 0.3), (Method::Sc, 0.4)] {
        let learned = error(method, &settings);
        assert!(learned < share * untrained, "{method:?}: {learned} against {untrained} untrained");
    }
}

#[test]
fn metrics_have_one_row_an_epoch() {
    let (mut logged, go) = (Vec::new(), Interrupt::default());
    let hooks = Hooks { log: Box::new(|m, _| logged.push(m.clone())), ..Hooks::new(&go) };
    let inputs = Inputs::new(demos(Toy::Stack, 8, 30, 0), demos(Toy::Stack, 2, 30, 100)).expect("demos");
    let dynamics = pretrain(Toy::Stack, 1).0;
    let trained = train(Method::Hil, inputs, Some(dynamics), &quick(), 7, hooks).expect("trains");
    assert_eq!(trained.metrics.rows(), logged.len());
    let last = logged.last().expect("epochs");
    assert_eq!((last.stage.as_str(), last.epoch, last.epochs, last.updates), ("hil", 4, 4, 8));
    for name in ["l_bc", "l_sc", "l_mix", "d_conv", "alpha", "grad_bc", "grad_sc", "l_model", "learning_rate"] {
        assert!(last.get(name).is_finite() && last.get(name) >= 0.0, "{name}");
    }
    let known = |column: &&Column| matches!(&column.values, Values::F64(v) if v.iter().any(|v| v.is_finite()));
    let unknown: Vec<&str> = trained.metrics.columns.iter().filter(|c| !known(c)).map(|c| c.name.as_str()).collect();
    // the toys' fingers neither open nor close
    let errors = ["opening", "closing"].map(|class| [format!("arm_error_{class}_rad_s"), format!("finger_error_{class}_rad_s")]);
    let names = ["stage", "epoch", "updates"].into_iter().chain(errors.as_flattened().iter().map(String::as_str));
    assert_eq!(unknown, names.collect::<Vec<_>>());
}

#[test]
fn what_cannot_work_is_refused_in_words() {
    let refused = |method, settings: &TrainSettings, dynamics| run(method, settings, dynamics).expect_err("refused");
    for (settings, key) in [
        (TrainSettings { rho: 1.2, ..quick() }, "train.rho = 1.2"),
        (TrainSettings { alpha: Alpha::Fixed(-0.1), ..quick() }, "train.alpha = -0.1"),
        (TrainSettings { tau: f64::NAN, ..quick() }, "train.tau"),
        (TrainSettings { hidden_layers: 0, ..quick() }, "train.hidden_layers"),
    ] {
        let error = refused(Method::Bc, &settings, None);
        assert!(matches!(&error, Error::Usage(m) if m.contains(key)), "{error}");
    }
    assert!(refused(Method::Hil, &quick(), None).to_string().contains("hilt pretrain"));
    let other = pretrain(Toy::PickUp, 1).0;
    let message = refused(Method::Hil, &quick(), Some(other)).to_string();
    assert!(message.contains("28") && message.contains("21"), "{message}");

    let none: &[Demo] = &[];
    let go = Interrupt::default();
    let error = Inputs::new(none, none).err().expect("no demos");
    assert!(error.to_string().contains("no training demo"));
    let diverging = TrainSettings { warm_start_learning_rate: 1e30, clip_norm: 0.0, ..quick() };
    let message = refused(Method::Bc, &diverging, None).to_string();
    assert!(message.contains("L_BC"), "{message}");
    go.raise(2);
    let (some, held_out) = (demos(Toy::Stack, 2, 9, 0), demos(Toy::Stack, 1, 9, 9));
    let inputs = Inputs::new(&some, &held_out).expect("demos");
    let error = train(Method::Bc, inputs, None, &quick(), 0, Hooks::new(&go)).expect_err("interrupted");
    assert!(matches!(error, Error::Interrupted));
}

/// The literal reading of the paper, as its pipeline files set it.
const PAPER_PRETRAIN: &str = r#"
features = "raw"
structure = "plain"
loss = "raw-sum"
epochs = 2
batch_rows = 0
final_learning_rate = 1e-3
clip_norm = 0.0
ema_decay = 0.0
"#;
const PAPER_TRAIN: &str = r#"
features = "raw"
mask_dq = false
loss = "raw-sum"
action = "sample"
std_floor = 1e-3
alpha_average = false
alpha_max = 1.0
rho = 0.6
sc.pairs = "after-recovery"
sc.mask_dq = false
sc.knee = 0.0
sc.balance = false
sc.noise_variance = 0.0
sc.pulses.probability = 0.0
dynamics_learning_rate = 1e-3
warm_start_updates = 0
min_updates = 0
epochs = 3
batch = 1
learning_rate = 1e-3
final_learning_rate = 1e-3
clip_norm = 0.0
ema_decay = 0.0
"#;

#[test]
fn the_literal_preset_parses_and_trains() {
    let pretrain: PretrainSettings = toml::from_str(PAPER_PRETRAIN).expect("known keys");
    let settings: TrainSettings = toml::from_str(PAPER_TRAIN).expect("known keys");
    let (some, held_out) = (demos(Toy::PickUp, 6, 30, 0), demos(Toy::PickUp, 2, 30, 100));
    let go = Interrupt::default();
    let (dynamics, _) = pretrain_dynamics(&some, &held_out, &pretrain, 0, &mut |_, _| {}, &go).expect("pretrains");
    for rho in [0.0, 0.6, 1.0] {
        let settings = TrainSettings { rho, ..settings.clone() };
        let model = Some(dynamics.clone());
        let trained = train(Method::Hil, Inputs::new(&some, &held_out).expect("demos"), model, &settings, 0, Hooks::new(&go))
            .expect("trains");
        assert_eq!(trained.metrics.rows(), 3);
    }
    let alpha = |text: &str| toml::from_str::<TrainSettings>(text).map(|s| s.alpha).map_err(|e| e.to_string());
    assert_eq!(alpha("alpha = \"adaptive\""), Ok(Alpha::Adaptive));
    assert_eq!(alpha("alpha = 0.3"), Ok(Alpha::Fixed(0.3)));
    assert_eq!(alpha("alpha = 1"), Ok(Alpha::Fixed(1.0)));
    assert!(alpha("alpha = \"auto\"").expect_err("refused").contains("adaptive"));
}

/// One update an epoch: the validation demos meet the diverged network before another update does.
#[test]
fn pretraining_whose_validation_loss_is_no_number_fails_and_says_since_when() {
    let (train, held_out) = (demos(Toy::Stack, 4, 20, 0), demos(Toy::Stack, 2, 20, 100));
    let fails = |settings: PretrainSettings| {
        let result = pretrain_dynamics(&train, &held_out, &settings, 0, &mut |_, _| {}, &Interrupt::default());
        result.expect_err("diverged").to_string()
    };
    let diverging =
        PretrainSettings { hidden_units: 8, epochs: 5, batch_rows: 1_000_000, learning_rate: 1e38, ..Default::default() };
    let message = fails(PretrainSettings { ema_decay: 0.0, ..diverging.clone() });
    for part in
        ["Eq. 6", "on the validation demos is", "after pretrain epoch 1 of 5", "pretrain.learning_rate", "nothing was written"]
    {
        assert!(message.contains(part), "{part}: {message}");
    }
    let message = fails(PretrainSettings { batch_rows: 16, ..diverging });
    assert!(
        message.contains("Eq. 6") && message.contains("at update 2") && message.contains("pretrain.learning_rate"),
        "{message}"
    );
}

/// No learning rate is to blame for what was so before anything was learned.
#[test]
fn a_loss_that_is_none_before_the_first_update_blames_the_demos_and_not_the_learning_rate() {
    let settings = quick();
    let (train, held_out) = (demos(Toy::Stack, 2, 9, 0), demos(Toy::Stack, 1, 9, 9));
    let inputs = Inputs::new(&train, &held_out).expect("demos");
    let mut bc = Hil::new(inputs, None, Alpha::Fixed(0.0), &settings, 0).expect("a policy");
    bc.policy_mut().net.params_mut().fill(f32::NAN);
    let message = bc.clone_behavior(&[0, 1, 2], 1e-3).expect_err("no number").to_string();
    assert!(message.contains("L_BC (Eq. 3) is NaN before the first update: look at the demos"), "{message}");
    assert!(!message.contains("learning_rate"), "{message}");
    let message = bc.clone_behavior(&[0, 1, 2], 1e-3).expect_err("no number").to_string();
    assert!(message.contains("train.learning_rate"), "{message}");
}

#[test]
fn demos_that_never_change_are_learned_from_without_a_loss_that_is_none() {
    let still = |seed| {
        let like = demo(Toy::PickUp, 12, seed);
        let row = like.state(0).to_vec();
        let states = row.repeat(13);
        Demo::new(like.layout(), states, vec![0.0; 12 * JOINTS], vec![0.0; 12 * JOINTS]).expect("lengths match")
    };
    let (one, other) = ([still(1), still(1)], [still(1)]);
    let settings = PretrainSettings { hidden_units: 8, epochs: 2, ..Default::default() };
    let (dynamics, _) = pretrain_dynamics(&one, &other, &settings, 0, &mut |_, _| {}, &Interrupt::default())
        .expect("constant columns are no fault");
    let inputs = Inputs::new(&one, &other).expect("demos");
    train(Method::Hil, inputs, Some(dynamics), &quick(), 7, Hooks::new(&Interrupt::default())).expect("trains");
}
