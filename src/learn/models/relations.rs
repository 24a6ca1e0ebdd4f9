//! What kinematics derive from a state: where the hand is, each object in the hand's frame, and what is missing to where it is to go.

use super::hand::{Arm, Hand, Vec3, add, cross, sub, turn, turn_back};
use crate::layout::{Layout, MOST_AIMS, MOST_OBJECTS};
use crate::nn::{LANES, Lanes};

/// Tool position and two columns of the hand's rotation.
pub const HAND_WIDTH: usize = 9;

/// What kinematics derive from a state: tool point, two columns of the hand's rotation, each object in the hand's frame, and for each aim
/// where the object is to go minus where it is. Only the first [`Relating::width`] entries are used.
pub type Relations = [Lanes; MOST_RELATIONS];
const MOST_RELATIONS: usize = HAND_WIDTH + 3 * (MOST_OBJECTS + MOST_AIMS);
/// Where nothing is related.
pub const UNRELATED: Relations = [Lanes([0.0; LANES]); MOST_RELATIONS];

/// Where a gradient comes from: its three entries in what was derived, by the first.
pub type Pull<'a> = &'a dyn Fn(usize) -> Vec3;

/// How a layout's states are related.
#[derive(Clone, Debug, PartialEq)]
pub struct Relating {
    arm: Option<Arm>,
    /// First entry of each object that may move.
    objects: Vec<usize>,
    aims: Vec<Aim>,
    /// Entries of a state that may change.
    pub changing: usize,
}

/// First entries of an object and of where it is to go, and what is added to the latter \[m\].
#[derive(Clone, Debug, PartialEq)]
struct Aim {
    object: usize,
    target: usize,
    offset: [f32; 3],
}

impl Relating {
    /// As the layout says.
    pub fn new(layout: &Layout) -> Self {
        let aim =
            |(object, target, offset_m): (usize, usize, [f64; 3])| Aim { object, target, offset: offset_m.map(|v| v as f32) };
        Relating {
            arm: layout.arm.as_ref().map(Arm::new),
            objects: layout.objects().map(|(_, at)| at).collect(),
            aims: layout.aims().map(aim).collect(),
            changing: layout.changing(),
        }
    }

    /// Number of relations: none without a known arm.
    pub fn width(&self) -> usize {
        if self.arm.is_none() { 0 } else { HAND_WIDTH + self.near_width() }
    }

    /// How many of them, from the last, are distances that are to become 0.
    pub fn near_width(&self) -> usize {
        if self.arm.is_none() { 0 } else { 3 * (self.objects.len() + self.aims.len()) }
    }

    /// Where the hand is in these states.
    pub fn hand(&self, state: &[Lanes]) -> Hand {
        self.arm.as_ref().map_or_else(Hand::default, |arm| arm.hand(state))
    }

    /// The relations in a panel of states.
    pub fn relations(&self, state: &[Lanes], hand: &Hand) -> Relations {
        let mut related = UNRELATED;
        let parts = [hand.tool, hand.columns[0], hand.columns[1]].into_iter();
        let in_hand = self.objects.iter().map(|at| turn_back(&hand.columns, sub(vec3(state, *at), hand.tool)));
        let missing = self.aims.iter().map(|aim| {
            let target = vec3(state, aim.target);
            let target = if aim.offset == [0.0; 3] { target } else { add(target, aim.offset.map(Lanes::splat)) };
            sub(target, vec3(state, aim.object))
        });
        let parts = parts.chain(in_hand).chain(missing).flatten();
        related.iter_mut().zip(parts).for_each(|(slot, value)| *slot = value);
        related
    }

    /// Adds to `d_state` what a gradient with respect to the relations, `d`, sends back to the entries of the state that may change.
    pub fn backward(&self, state: &[Lanes], hand: &Hand, d: Pull, d_state: &mut [Lanes]) {
        let (mut force, mut moment) = (d(0), add(cross(hand.columns[0], d(3)), cross(hand.columns[1], d(6))));
        for (i, at) in self.objects.iter().enumerate() {
            // object in hand = R^T (object - tool); its gradient in the world's frame pulls at the object and pushes at the hand
            let pull = turn(&hand.columns, d(HAND_WIDTH + 3 * i));
            let arm = sub(vec3(state, *at), hand.tool);
            (force, moment) = (sub(force, pull), sub(moment, cross(arm, pull)));
            let aims = self.aims.iter().enumerate().filter(|(_, aim)| aim.object == *at);
            let d_object = aims.fold(pull, |sum, (k, _)| sub(sum, d(HAND_WIDTH + 3 * (self.objects.len() + k))));
            d_state[*at..].iter_mut().zip(d_object).for_each(|(slot, d)| *slot += d);
        }
        for (k, aim) in self.aims.iter().enumerate().filter(|(_, aim)| aim.target < self.changing) {
            let d_target = d(HAND_WIDTH + 3 * (self.objects.len() + k));
            d_state[aim.target..].iter_mut().zip(d_target).for_each(|(slot, d)| *slot += d);
        }
        hand.add_joint_gradient(force, moment, d_state);
    }
}

/// Three entries of a panel of rows.
fn vec3(row: &[Lanes], at: usize) -> Vec3 {
    [row[at], row[at + 1], row[at + 2]]
}
