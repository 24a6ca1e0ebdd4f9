//! A policy from arrays of your own, without robot, task or file: a point that is pushed to the origin. `cargo run --release --example own_arrays`

use hilt::config::{FeatureSet, TrainSettings};
use hilt::demo::Demo;
use hilt::interrupt::Interrupt;
use hilt::layout::{Holds, Layout, Span};
use hilt::learn::{Hooks, Inputs, MethodName, train};
use std::sync::Arc;

/// Control period \[s\], and how fast the demonstrator comes back \[1/s\].
const PERIOD_S: f64 = 0.05;
const BACK_PER_S: f32 = 1.5;

fn span(name: &str, holds: Holds, entries: [&str; 2]) -> Span {
    Span { name: name.into(), holds, entries: entries.map(String::from).into() }
}

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let layout = Arc::new(Layout {
        name: "point".into(),
        period_s: PERIOD_S,
        state: vec![span("at", Holds::Numbers, ["x_m", "y_m"])],
        action: vec![span("velocity", Holds::Commands, ["vx_m_s", "vy_m_s"])],
        action_limits: vec![],
        action_units: vec![],
        aims: vec![],
        arm: None,
    });
    // 20 demos of 40 steps, each from another place; a demo has a state more than actions.
    let demo = |number: usize| {
        let (mut at, mut states, mut actions) =
            ([(number % 5) as f32 / 2.0 - 1.0, (number / 5) as f32 / 2.0 - 0.75], vec![], vec![]);
        for _ in 0..40 {
            let velocity = at.map(|x| -BACK_PER_S * x);
            states.extend(at);
            actions.extend(velocity);
            at = [0, 1].map(|i| at[i] + PERIOD_S as f32 * velocity[i]);
        }
        states.extend(at);
        Demo::new(&layout, states, actions.clone(), actions)
    };
    let demos = (0..20).map(demo).collect::<Result<Vec<_>, _>>()?;
    let inputs = Inputs::new(&demos[..18], &demos[18..])?;
    let settings = TrainSettings {
        features: FeatureSet::Raw,
        warm_start_updates: 1500.into(),
        epochs: 0,
        hidden_units: 32,
        ..Default::default()
    };
    let trained = train(MethodName::Bc, inputs, None, &settings, 0, Hooks::new(&Interrupt::default()))?;
    for at in [[0.5, -0.5], [-0.3, 0.2]] {
        let (velocity, wanted) = (trained.policy.act(&at), at.map(|x| -BACK_PER_S * x));
        println!("at {at:?} m: {velocity:.3?} m/s, the demonstrator {wanted:.3?}");
        assert!(velocity.iter().zip(wanted).all(|(v, w)| (v - w).abs() < 0.1), "it should have learned this by now");
    }
    Ok(())
}
