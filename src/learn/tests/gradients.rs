//! Losses of Algorithms 2 and 3 against finite differences, and the batched segments against Algorithm 3 step by step.

use super::testing::{ARM_JOINTS, BASE_DIM, FINGERS, JOINTS, Toy, demos};
use crate::config::{
    ActionChoice, FeatureSet, FingerCloning, Objective, Pairs, PretrainSettings, PulseSettings, ScSettings, StateScale,
    Structure, TrainSettings,
};
use crate::learn::losses::shards::add_scaled;
use crate::learn::losses::state_cloning::{self as sc, Pushes, Segment, draw_segments};
use crate::learn::losses::{
    Acted, behavior_cloning,
    behavior_cloning::{self as bc},
    state_cloning,
};
use crate::learn::models::{Corpus, Dynamics, Policy, PolicySamples, row};
use crate::math::exp_f32;
use crate::nn::{Activation, LANES, Lanes, Pass};
use crate::seed::stream;
use rand::RngExt;

struct World {
    corpus: Corpus,
    policy: Policy,
    dynamics: Dynamics,
    rows: Vec<usize>,
    settings: TrainSettings,
}

fn world(toy: Toy, structure: Structure, settings: TrainSettings) -> World {
    let corpus = Corpus::new(demos(toy, 8, 20, 5), "training").expect("demos");
    let (mut rng, mut rows) = (stream(2, "world", 0), Vec::new());
    corpus.rows_of(&[6, 1, 3, 0, 5, 2, 4, 7], &mut rows);
    let policy = Policy::new(&corpus, &settings, &mut rng);
    let pretrain = PretrainSettings { structure, hidden_units: 16, features: settings.features, ..Default::default() };
    let dynamics = Dynamics::new(&corpus, &pretrain, &mut rng);
    World { rows, corpus, policy, dynamics, settings }
}

fn small(settings: TrainSettings) -> TrainSettings {
    TrainSettings { hidden_units: 12, hidden_layers: 2, ..settings }
}

impl World {
    fn samples(&self) -> PolicySamples<'_> {
        PolicySamples { corpus: &self.corpus, policy: &self.policy }
    }

    fn acted(&self) -> Acted {
        let mut acted = Acted::new(&self.policy, self.rows.len());
        acted.forward(self.samples(), &self.rows, None);
        acted
    }

    /// L_BC with its whole gradient.
    fn bc_loss(&self, gradient: &mut Vec<f32>, d_log_std: &mut [f32]) -> f64 {
        let (mut acted, mut work) = (self.acted(), bc::Workspace::new(JOINTS, self.rows.len()));
        let batch = bc::Batch { samples: self.samples(), rows: &self.rows, demos: 8.0 };
        let mut rng = stream(4, "noise", 0);
        let (l_bc, _) = behavior_cloning(&acted, batch, &bc::Choices::new(&self.settings), &mut rng, &mut work);
        gradient.resize(self.policy.net.params().len(), 0.0);
        acted.gradient(&self.policy, 1.0 * l_bc, gradient);
        (1.0 * l_bc).d_log_std(d_log_std);
        l_bc.value
    }

    fn segments(&self) -> Vec<Segment> {
        let mut segments = Vec::new();
        let lengths = [6, 1, 3, 0, 5, 2, 4, 7].map(|d| self.corpus.demo(d).len());
        let mut rng = stream(5, "coins", 0);
        draw_segments(lengths.into_iter(), self.settings.rho, self.settings.sc.pairs, &mut rng, &mut segments);
        segments
    }

    fn pushes(&self) -> Pushes {
        let mut pushes = Pushes::new(&self.settings.sc, &self.corpus.layout, self.rows.len());
        let lengths = [6, 1, 3, 0, 5, 2, 4, 7].map(|d| self.corpus.demo(d).len());
        pushes.draw(lengths.into_iter(), &mut stream(8, "pushes", 0));
        pushes
    }

    /// L_SC with its whole gradient; nothing else has been computed before.
    fn sc_loss(&self, gradient: &mut Vec<f32>, d_log_std: &mut [f32]) -> f64 {
        let (mut acted, mut work) = (self.acted(), sc::Workspace::new(JOINTS, self.rows.len()));
        let (noise, pushes, segments) = (noise(&self.settings, self.rows.len()), self.pushes(), self.segments());
        let batch = sc::Batch {
            corpus: &self.corpus,
            rows: &self.rows,
            demos: 8,
            segments: &segments,
            noise: &noise,
            pushes: pushes.rows(),
        };
        let choices = sc::Choices::new(&self.settings, &self.corpus);
        let l_sc = state_cloning(&self.policy, &self.dynamics, &acted, batch, &choices, &mut work);
        gradient.resize(self.policy.net.params().len(), 0.0);
        acted.gradient(&self.policy, 1.0 * l_sc, gradient);
        (1.0 * l_sc).d_log_std(d_log_std);
        l_sc.value
    }
}

fn noise(settings: &TrainSettings, rows: usize) -> Vec<f32> {
    let mut noise = Vec::new();
    bc::draw_noise(settings.action == ActionChoice::Sample, rows * JOINTS, &mut stream(6, "noise", 0), &mut noise);
    noise
}

/// Derivatives along random directions of all weights, and of each log standard deviation.
fn check(world: &mut World, gradient: &[f32], d_log_std: &[f32], mut loss: impl FnMut(&World) -> f64, what: &str) {
    let mut rng = stream(9, "directions", 0);
    let scale = (gradient.iter().map(|g| g * g).sum::<f32>().sqrt() / 10.0).max(1e-6);
    let close = |numeric: f64, analytic: f64, floor: f64, what: &str| {
        assert!((numeric - analytic).abs() < 0.02 * (numeric.abs() + floor), "{what}: {analytic} against {numeric}");
    };
    for k in 0..12 {
        // every second direction lies in one part of the weights, so that no layer hides behind another
        let n = gradient.len();
        let part = if k % 2 == 0 { 0..n } else { n * (k / 2) / 6..n * (k / 2 + 1) / 6 };
        let mut direction = vec![0.0f32; n];
        direction[part].iter_mut().for_each(|d| *d = 2.0 * rng.random::<f32>() - 1.0);
        let length = direction.iter().map(|d| d * d).sum::<f32>().sqrt();
        direction.iter_mut().for_each(|d| *d /= length);
        let kept = world.policy.net.params().to_vec();
        let mut at = |h: f32| {
            world.policy.net.params_mut().copy_from_slice(&kept);
            add_scaled(&mut world.policy.net.params_mut(), &direction, h);
            loss(world)
        };
        let h = 4e-3;
        let numeric = (at(h) - at(-h)) / f64::from(2.0 * h);
        at(0.0);
        let analytic = gradient.iter().zip(&direction).map(|(g, d)| f64::from(g * d)).sum::<f64>();
        close(numeric, analytic, f64::from(scale), &format!("{what}, direction {k}"));
    }
    let std_scale = d_log_std.iter().fold(1e-6f32, |m, d| m.max(d.abs()));
    for (i, analytic) in d_log_std.iter().enumerate() {
        let mut at = |h: f32| {
            world.policy.log_std[i] += h;
            let value = loss(world);
            world.policy.log_std[i] -= h;
            value
        };
        let numeric = (at(1e-2) - at(-1e-2)) / 2e-2;
        close(numeric, f64::from(*analytic), f64::from(std_scale), &format!("{what}, log std {i}"));
    }
}

#[test]
fn behavior_cloning_gradient_equals_finite_differences() {
    for (action, loss) in [(ActionChoice::Mean, Objective::StandardisedMean), (ActionChoice::Sample, Objective::RawSum)] {
        let settings = small(TrainSettings { action, loss, ..Default::default() });
        let mut world = world(Toy::Stack, Structure::Plain, settings);
        let (mut gradient, mut d_log_std) = (Vec::new(), [0.0; JOINTS]);
        world.bc_loss(&mut gradient, &mut d_log_std);
        // under the mean action the log standard deviations learn from the likelihood, which nn::gaussian tests
        let d_log_std = if action == ActionChoice::Sample { d_log_std.to_vec() } else { vec![] };
        let loss = |w: &World| w.bc_loss(&mut Vec::new(), &mut [0.0; JOINTS]);
        check(&mut world, &gradient, &d_log_std, loss, &format!("{action:?}"));
    }
}

fn sc_worlds() -> Vec<(&'static str, World)> {
    let defaults = TrainSettings { rho: 0.3, ..Default::default() };
    vec![
        ("fk-near, kinematic", world(Toy::Stack, Structure::Kinematic, small(defaults.clone()))),
        (
            "raw, plain, sampled, literal",
            world(
                Toy::PickUp,
                Structure::Plain,
                small(TrainSettings {
                    features: FeatureSet::Raw,
                    mask_dq: false,
                    action: ActionChoice::Sample,
                    loss: Objective::RawSum,
                    sc: ScSettings {
                        pairs: Pairs::AfterRecovery,
                        mask_dq: false,
                        knee: 0.0,
                        noise_variance: 0.0,
                        pulses: PulseSettings::default(),
                        ..Default::default()
                    },
                    ..defaults.clone()
                }),
            ),
        ),
        (
            "fk, relu, state scale, no recovery",
            world(
                Toy::PickAndPlace,
                Structure::Kinematic,
                small(TrainSettings {
                    features: FeatureSet::Fk,
                    mask_dq: false,
                    activation: Activation::Relu,
                    sc: ScSettings { scale: StateScale::State, ..Default::default() },
                    rho: 0.0,
                    ..defaults
                }),
            ),
        ),
    ]
}

#[test]
fn state_cloning_gradient_equals_finite_differences() {
    for (name, mut world) in sc_worlds() {
        let (mut gradient, mut d_log_std) = (Vec::new(), [0.0; JOINTS]);
        world.sc_loss(&mut gradient, &mut d_log_std);
        let d_log_std = if world.settings.action == ActionChoice::Sample { d_log_std.to_vec() } else { vec![] };
        check(&mut world, &gradient, &d_log_std, |w| w.sc_loss(&mut Vec::new(), &mut [0.0; JOINTS]), name);
    }
}

/// Algorithm 3 as printed, one demo and one step at a time, with back-propagation through time along the demo. A step has a panel for
/// itself: its states stand in all lanes, its gradient in the first alone.
fn step_by_step(world: &World, gradient: &mut [f32]) -> f64 {
    let World { corpus, policy, dynamics, settings, .. } = world;
    let choices = sc::Choices::new(settings, corpus);
    let scale = choices.scale(world.rows.len(), 8);
    let (noise, pushes) = (noise(settings, world.rows.len()), world.pushes());
    let first_lane = |v: f32| Lanes(std::array::from_fn(|l| if l == 0 { v } else { 0.0 }));
    let splat = |row: &[f32]| -> Vec<Lanes> { row.iter().map(|v| Lanes::splat(*v)).collect() };
    let (mut coins, mut l_sc, mut at) = (stream(5, "coins", 0), 0.0f64, 0);
    for demo in [6, 1, 3, 0, 5, 2, 4, 7] {
        let rows = corpus.demo(demo);
        let steps = rows.len();
        let (mut pi, mut f) = (Pass::new(&policy.net, steps), Pass::new(&dynamics.net, steps));
        let (mut states, mut d_predictions, mut recovered) = (vec![splat(corpus.state(rows.start))], Vec::new(), Vec::new());
        for t in 0..steps {
            let s = states[t].clone();
            policy.features().forward(&s, &policy.features().hand(&s), pi.input.panel_mut(t));
            policy.net.forward(&mut pi, t..t + 1);
            let action: Vec<Lanes> = (0..JOINTS)
                .map(|k| {
                    let eps = noise.get((at + t) * JOINTS + k).copied().unwrap_or(0.0);
                    let mean = pi.output.get(t * LANES, k) + exp_f32(policy.log_std[k]) * eps;
                    let push = pushes.rows().get((at + t) * JOINTS + k).copied().unwrap_or(0.0);
                    Lanes::splat(policy.action_scaling().undo(k, mean) + push)
                })
                .collect();
            dynamics.write_inputs(&s, &action, f.input.panel_mut(t));
            dynamics.net.forward(&mut f, t..t + 1);
            let mut prediction = s.clone();
            dynamics.write_next(&s, &action, f.output.panel(t), &mut prediction[..BASE_DIM]);
            let target = corpus.next(rows.start + t);
            let coin = coins.random::<f64>() < settings.rho;
            let counts = !(coin && settings.sc.pairs == Pairs::AfterRecovery);
            let mut d_prediction = [Lanes::default(); BASE_DIM];
            for k in (0..BASE_DIM).filter(|_| counts) {
                let error = prediction[k].0[0] - target[k];
                let (weight, size) = (choices.weights[k], error.abs() * choices.weights[k].sqrt());
                let knee = if settings.sc.knee > 0.0 { settings.sc.knee as f32 } else { f32::INFINITY };
                let over = (size - knee).max(0.0); // squared error up to the knee, its tangent from there
                l_sc += f64::from(scale * (size * size - over * over));
                d_prediction[k] = first_lane(2.0 * scale * weight.sqrt() * size.min(knee) * error.signum());
            }
            if coin {
                prediction[..BASE_DIM].copy_from_slice(&splat(target));
            }
            d_predictions.push(d_prediction);
            recovered.push(coin);
            states.push(prediction);
        }
        let mut carry = [Lanes::default(); BASE_DIM];
        for t in (0..steps).rev() {
            let mut d_next = d_predictions[t];
            if !recovered[t] {
                d_next.iter_mut().zip(carry).for_each(|(d, carry)| *d += carry);
            }
            let known = dynamics.settings().structure == Structure::Kinematic;
            let residual = &dynamics.residual_scaling().std;
            (0..BASE_DIM).for_each(|k| f.d_output.panel_mut(t)[k] = d_next[k] * residual[k]);
            dynamics.net.backward(&mut f, t..t + 1);
            dynamics.net.backward_input(&mut f, t..t + 1);
            let seen = dynamics.features().width();
            for k in 0..JOINTS {
                let straight_through = k >= ARM_JOINTS && settings.sc.fingers == FingerCloning::StraightThrough;
                let mut d_action = f.d_input.panel(t)[seen + k] / dynamics.action_scaling().std[k];
                if straight_through {
                    d_action = Lanes::default();
                }
                if known || straight_through {
                    d_action += d_next[k] * 0.05 + d_next[JOINTS + k];
                }
                let d_mean = d_action * policy.action_scaling().std[k];
                let taught = k < ARM_JOINTS || row(&choices.taught, FINGERS, rows.start + t)[k - ARM_JOINTS] == 1.0;
                pi.d_output.panel_mut(t)[k] = if taught { d_mean } else { Lanes::default() };
            }
            policy.net.backward(&mut pi, t..t + 1);
            policy.net.backward_input(&mut pi, t..t + 1);
            carry = d_next;
            if known {
                carry[JOINTS..2 * JOINTS].fill(Lanes::default());
            }
            let s = &states[t];
            let (features, hand) = (policy.features(), policy.features().hand(s));
            features.backward(s, &hand, pi.input.panel(t), pi.d_input.panel(t), &mut carry);
            let (features, hand) = (dynamics.features(), dynamics.features().hand(s));
            features.backward(s, &hand, f.input.panel(t), f.d_input.panel(t), &mut carry);
        }
        policy.net.begin_gradient(&mut pi);
        policy.net.add_gradient(&mut pi, 0..steps);
        let mut of_demo = vec![0.0; gradient.len()];
        policy.net.finish_gradient([&mut pi], &mut of_demo);
        add_scaled(gradient, &of_demo, 1.0);
        at += steps;
    }
    l_sc
}

#[test]
fn batched_segments_equal_algorithm_3_step_by_step() {
    let of = |fingers| {
        let sc = ScSettings { fingers, ..Default::default() };
        small(TrainSettings { sc, rho: 0.3, ..Default::default() })
    };
    let masked = of(FingerCloning::None);
    let masked = ("fingers left out", world(Toy::Stack, Structure::Kinematic, masked));
    let straight = of(FingerCloning::StraightThrough);
    let straight = ("straight through the fingers", world(Toy::Stack, Structure::Plain, straight));
    for (name, world) in sc_worlds().into_iter().chain([masked, straight]) {
        let (mut batched, mut plain) = (Vec::new(), vec![0.0; world.policy.net.params().len()]);
        let loss = world.sc_loss(&mut batched, &mut [0.0; JOINTS]);
        let expected = step_by_step(&world, &mut plain);
        assert!((loss - expected).abs() < 1e-5 * expected, "{name}: {loss} against {expected}");
        let size = plain.iter().fold(0.0f32, |m, g| m.max(g.abs()));
        for (i, (a, b)) in batched.iter().zip(&plain).enumerate() {
            assert!((a - b).abs() < 1e-5 * size, "{name}, parameter {i}: {a} against {b}, largest {size}");
        }
    }
}
