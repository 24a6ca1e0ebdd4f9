//! The keys that shape L_SC, and what they make of the demos.

use crate::config::{ActionChoice, FingerCloning, Objective, StateScale, TrainSettings};
use crate::layout::Layout;
use crate::learn::models::{Corpus, STEP_FLOOR, Scaling};
use std::ops::Range;

/// Spread of a state entry below which L_SC counts it as constant under `train.sc.scale = "state"`.
const STATE_FLOOR: f32 = 0.01;

/// Share of the commanded motion that a finger may miss and still count as one that follows. Of 77,000 commands above the fingers' dead
/// zone in recorded stacks 28 % were followed to a twentieth, 70 % not at all (hand open, or holding), and 2 % lie between.
const FOLLOWING: f32 = 0.5;

/// Which fingers' commands L_SC teaches in transition `r`: 1, or 0. One whose position is not known follows.
fn taught_fingers(fingers: FingerCloning, corpus: &Corpus, r: usize) -> impl Iterator<Item = f32> {
    let (layout, dt_s) = (&corpus.layout, corpus.layout.period_s as f32);
    layout.fingers().map(move |i| {
        let commanded = dt_s * corpus.executed(r)[i];
        let moved = layout.positions().nth(i).map_or(commanded, |at| corpus.next(r)[at] - corpus.state(r)[at]);
        let missed = moved - commanded;
        f32::from(match fingers {
            FingerCloning::All | FingerCloning::StraightThrough => true,
            FingerCloning::Following => missed.abs() <= FOLLOWING * commanded.abs(),
            FingerCloning::None => false,
        })
    })
}

/// Whether entry `i` of a state is the position or the velocity of a finger.
fn is_finger(layout: &Layout, i: usize) -> bool {
    let fingers = layout.fingers();
    [layout.positions(), layout.velocities()]
        .into_iter()
        .any(|joints| joints.contains(&i) && fingers.contains(&(i - joints.start)))
}

/// What of L_SC does not change from update to update.
pub struct Choices {
    /// Weight of each state entry's squared error.
    pub weights: Vec<f32>,
    /// 1 where the gradient reaches a finger's command, else 0: transitions x fingers.
    pub taught: Vec<f32>,
    /// The entries of an action that drive fingers.
    pub fingers: Range<usize>,
    /// Whether the gradient with respect to a finger's command leaves out what the network makes of it.
    pub straight_through: bool,
    /// Error of each state entry beyond which the loss is a line.
    pub knees: Vec<f32>,
    /// Whether L_SC is a sum over a demo instead of a mean.
    objective: Objective,
    /// Whether actions are sampled.
    pub action: ActionChoice,
}

impl Choices {
    /// From the settings and the training demos.
    pub fn new(settings: &TrainSettings, corpus: &Corpus) -> Self {
        let (layout, dim, changing) = (&corpus.layout, corpus.layout.state_dim(), corpus.layout.changing());
        let of_states = || {
            let floor = |i| layout.state_unit(i).map_or(0.0, |unit| STATE_FLOOR * unit);
            Scaling::fit(corpus.rows(), dim, floor, |r, row| row.copy_from_slice(corpus.state(r))).std
        };
        let std = match (settings.loss, settings.sc.scale) {
            (Objective::RawSum, _) => vec![1.0; changing],
            (_, StateScale::State) => of_states(),
            (_, StateScale::Step) => {
                let change = |r: usize, row: &mut [f32]| {
                    let entries = row.iter_mut().zip(corpus.next(r).iter().zip(corpus.state(r)));
                    entries.for_each(|(change, (next, state))| *change = next - state);
                };
                let spread = of_states();
                let floor = |i: usize| STEP_FLOOR * layout.state_unit(i).unwrap_or(spread[i]);
                Scaling::fit(corpus.rows(), changing, floor, change).std
            }
        };
        let velocity = |i: usize| layout.velocities().contains(&i);
        let masked =
            |i: usize| settings.sc.mask_dq && velocity(i) || settings.sc.fingers == FingerCloning::None && is_finger(layout, i);
        let weights: Vec<f32> = (0..changing).map(|i| if masked(i) { 0.0 } else { 1.0 / (std[i] * std[i]) }).collect();
        let knee = if settings.sc.knee > 0.0 { settings.sc.knee as f32 } else { f32::INFINITY };
        Choices {
            knees: weights.iter().map(|weight| if *weight > 0.0 { knee / weight.sqrt() } else { f32::INFINITY }).collect(),
            weights,
            fingers: layout.fingers(),
            taught: (0..corpus.rows()).flat_map(|r| taught_fingers(settings.sc.fingers, corpus, r)).collect(),
            straight_through: settings.sc.fingers == FingerCloning::StraightThrough,
            objective: settings.loss,
            action: settings.action,
        }
    }

    /// Factor of every squared error: L_SC is a mean over entries and transitions, or a sum over each of the demos.
    pub fn scale(&self, rows: usize, demos: usize) -> f32 {
        match self.objective {
            Objective::RawSum => 1.0 / demos as f32,
            Objective::StandardisedMean => 1.0 / (rows * self.weights.len()) as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ScSettings;
    use crate::demo::Demo;
    use crate::learn::tests::testing::Toy;

    #[test]
    fn l_sc_teaches_fingers_that_follow_their_commands() {
        let (layout, command) = (Toy::PickUp.layout(), 0.4);
        let (finger, fingers) = (layout.fingers().start + 1, layout.fingers().len());
        let moves = [0.9, 0.6, 0.3, 0.0, -1.0, 1.6]; // shares of the commanded motion
        let mut states = vec![vec![0.0; layout.state_dim()]];
        for share in moves {
            let mut next = states[states.len() - 1].clone();
            next[finger] += share * layout.period_s as f32 * command;
            states.push(next);
        }
        let mut action = vec![0.0; layout.action_dim()];
        action[finger] = command;
        let actions = action.repeat(moves.len());
        let demo = Demo::new(&layout, states.concat(), actions.clone(), actions).expect("lengths match");
        let corpus = Corpus::new(&[demo], "training").expect("a demo");
        let taught = |cloning| {
            let sc = ScSettings { fingers: cloning, ..Default::default() };
            Choices::new(&TrainSettings { sc, ..Default::default() }, &corpus).taught
        };
        let of_finger: Vec<f32> = taught(FingerCloning::Following).into_iter().skip(1).step_by(fingers).collect();
        assert_eq!(of_finger, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(taught(FingerCloning::All), vec![1.0; 6 * fingers]);
        assert_eq!(taught(FingerCloning::None), vec![0.0; 6 * fingers]);
    }
}
