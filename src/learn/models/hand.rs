//! The hand's pose from the arm's joint angles in f32, with what its derivative needs: per joint, axis and origin in the world. Eight
//! states at a time.

use crate::layout::{Chain, MOST_ARM_JOINTS};
use crate::nn::Lanes;
use std::f32::consts::FRAC_2_PI;

/// Eight vectors.
pub type Vec3 = [Lanes; 3];

/// Where hand and joints are at some joint angles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hand {
    /// Tool point \[m\].
    pub tool: Vec3,
    /// Columns of `world_from_hand`.
    pub columns: [Vec3; 3],
    /// World axis of each arm joint.
    pub axes: [Vec3; MOST_ARM_JOINTS],
    /// World position of each arm joint \[m\].
    pub origins: [Vec3; MOST_ARM_JOINTS],
    /// Joints of the arm.
    pub joints: usize,
}

/// The fixed transforms of the arm, in f32.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Columns of the rotation and origin of each joint's frame in the one before.
    frames: Vec<([[f32; 3]; 3], [f32; 3])>,
    tool: [f32; 3],
}

impl Arm {
    /// In single precision.
    pub fn new(chain: &Chain) -> Self {
        let single = |v: [f64; 3]| v.map(|v| v as f32);
        let frames = chain.joints.iter().map(|frame| (frame.columns.map(single), single(frame.origin_m)));
        Arm { frames: frames.collect(), tool: single(chain.tool_m) }
    }

    /// The hand at joint angles `q` (the arm's are read) \[rad\].
    pub fn hand(&self, q: &[Lanes]) -> Hand {
        let mut hand = Hand { joints: self.frames.len(), ..Hand::default() };
        (0..3).for_each(|i| hand.columns[i][i] = Lanes::splat(1.0));
        let mut position = Vec3::default();
        for (i, ((rotation, origin), angle)) in self.frames.iter().zip(q).enumerate() {
            position = add(position, turn(&hand.columns, origin.map(Lanes::splat)));
            let [x, y, z] = rotation.map(|column| turn(&hand.columns, column.map(Lanes::splat)));
            let (sin, cos) = sin_cos(*angle);
            hand.columns = [add(scale(x, cos), scale(y, sin)), sub(scale(y, cos), scale(x, sin)), z];
            hand.axes[i] = z;
            hand.origins[i] = position;
        }
        hand.tool = add(position, turn(&hand.columns, self.tool.map(Lanes::splat)));
        hand
    }
}

impl Hand {
    /// Adds to `d_q` the gradient that reaches the joints when a force `f` pulls at the tool point and a moment `m` turns the hand:
    /// joint i gets z_i . ((p - o_i) x f + m).
    pub fn add_joint_gradient(&self, f: Vec3, m: Vec3, d_q: &mut [Lanes]) {
        for (i, d) in d_q[..self.joints].iter_mut().enumerate() {
            let lever = sub(self.tool, self.origins[i]);
            *d += dot(self.axes[i], add(cross(lever, f), m));
        }
    }
}

/// pi / 2 in two parts: the first has few digits, so that its product with a number of quarter turns is exact.
pub const HALF_PI: [f32; 2] = [1.570_312_5, 4.838_268e-4];
/// Taylor series of sin(f) / f in f^2, for |f| <= pi / 4; the first term left out is worth 2e-9.
pub const SIN: Series = Series { terms: [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0], last: 362_880.0 };
/// Taylor series of cos(f) in f^2; the first term left out is worth 2e-8.
pub const COS: Series = Series { terms: [1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0], last: 40_320.0 };
/// 1.5 x 2^23: adding it rounds a small f32 to an integer, which then stands in the low bits.
const ROUND: f32 = 12_582_912.0;

/// A polynomial.
#[derive(Clone, Copy, Debug)]
pub struct Series {
    /// Its coefficients from the constant on, without the last.
    pub terms: [f32; 4],
    /// One over the last.
    pub last: f32,
}

impl Series {
    /// Its value at `x`.
    #[inline(always)]
    fn at(&self, x: f32) -> f32 {
        let [a, b, c, d] = self.terms;
        a + x * (b + x * (c + x * (d + x / self.last)))
    }
}

/// Sine and cosine to about 2e-7 for |x| up to a few dozen turns; the same bytes on every platform, unlike the system's.
#[inline(always)]
pub fn sin_cos(x: Lanes) -> (Lanes, Lanes) {
    let rounded = x.map(|x| x * FRAC_2_PI + ROUND);
    let turns = rounded.map(|r| r - ROUND);
    let f = (x - turns * HALF_PI[0]) - turns * HALF_PI[1];
    let f2 = f * f;
    let sin = f * f2.map(|f2| SIN.at(f2));
    let cos = f2.map(|f2| COS.at(f2));
    // a quarter turn makes (sin, cos) of (cos, -sin)
    let quarter = |i: usize| rounded.0[i].to_bits();
    let pick = |i: usize, even: f32, odd: f32, minus: u32| {
        let value = if quarter(i) & 1 == 0 { even } else { odd };
        f32::from_bits(value.to_bits() ^ (minus & 2) << 30)
    };
    (
        Lanes(std::array::from_fn(|i| pick(i, sin.0[i], cos.0[i], quarter(i)))),
        Lanes(std::array::from_fn(|i| pick(i, cos.0[i], sin.0[i], quarter(i).wrapping_add(1)))),
    )
}

/// a + b.
#[inline(always)]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b.
#[inline(always)]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a times s.
#[inline(always)]
pub fn scale(a: Vec3, s: Lanes) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// a . b.
#[inline(always)]
pub fn dot(a: Vec3, b: Vec3) -> Lanes {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a x b.
#[inline(always)]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// R v, R given by its columns.
#[inline(always)]
pub fn turn(columns: &[Vec3; 3], v: Vec3) -> Vec3 {
    add(add(scale(columns[0], v[0]), scale(columns[1], v[1])), scale(columns[2], v[2]))
}

/// R^T v.
#[inline(always)]
pub fn turn_back(columns: &[Vec3; 3], v: Vec3) -> Vec3 {
    [dot(columns[0], v), dot(columns[1], v), dot(columns[2], v)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;
    use crate::nn::LANES;
    use crate::robot::file::built_in::paper_robot;
    use crate::task::built_in::stack;

    #[test]
    fn sine_and_cosine_are_close() {
        for i in -5_000..5_000 {
            let x = Lanes(std::array::from_fn(|l| (i * LANES as i32 + l as i32) as f32 * 1e-3));
            let (sin, cos) = sin_cos(x);
            for (x, (sin, cos)) in x.0.iter().zip(sin.0.iter().zip(cos.0)) {
                assert!((f64::from(*sin) - math::sin_cos(f64::from(*x)).0).abs() < 3e-7, "sin {x}");
                assert!((f64::from(cos) - math::sin_cos(f64::from(*x)).1).abs() < 3e-7, "cos {x}");
            }
        }
    }

    #[test]
    fn the_hand_is_where_the_arms_own_kinematics_have_it() {
        // lane 5 holds the angles in question, the others something else
        let q = paper_robot().ready.map(|v| v + 0.3);
        let arm = Arm::new(stack().layout(&paper_robot()).arm.as_ref().expect("the arm is known"));
        let lanes = |v: &f64| Lanes(std::array::from_fn(|l| *v as f32 + 0.1 * (l as f32 - 5.0)));
        let hand = arm.hand(&q.iter().map(lanes).collect::<Vec<_>>());
        let (tool, jacobian) = paper_robot().tool_jacobian(&q);
        let matrix = tool.rotation.to_rotation_matrix();
        for r in 0..3 {
            assert!((f64::from(hand.tool[r].0[5]) - tool.translation.vector[r]).abs() < 1e-6);
            (0..3).for_each(|c| assert!((f64::from(hand.columns[c][r].0[5]) - matrix[(r, c)]).abs() < 1e-6));
            let (mut along, mut about) = ([Lanes::default(); 6], [Lanes::default(); 6]);
            let unit = std::array::from_fn(|k| Lanes::splat(if k == r { 1.0 } else { 0.0 }));
            hand.add_joint_gradient(unit, Vec3::default(), &mut along);
            hand.add_joint_gradient(Vec3::default(), unit, &mut about);
            for i in 0..6 {
                assert!((f64::from(along[i].0[5]) - jacobian[(r, i)]).abs() < 1e-5);
                assert!((f64::from(about[i].0[5]) - jacobian[(r + 3, i)]).abs() < 1e-5);
            }
        }
    }
}
