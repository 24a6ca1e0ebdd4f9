//! What no command may ask of a robot: speeds beyond its joints', and motion that leads out of their range.

use crate::layout::Layout;
use crate::robot::Robot;

/// The limits of an action's entries.
#[derive(Clone, Debug)]
pub struct Bounds {
    velocity: Vec<f32>,
    /// Of joints that something stops.
    position: Vec<Option<[f32; 2]>>,
    /// How long a command lasts \[s\].
    step_s: f32,
}

/// Which entries of an action were changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limited {
    /// By the limit of the joint's velocity.
    pub velocity: Vec<usize>,
    /// Because the joint would have come out of its range within the step.
    pub position: Vec<usize>,
}

impl Limited {
    /// Whether none was.
    pub fn is_empty(&self) -> bool {
        self.velocity.is_empty() && self.position.is_empty()
    }
}

impl Bounds {
    /// Of a robot whose rows the layout describes, and whose commands last `step_s`. Of no known robot there are none.
    pub fn new(layout: &Layout, robot: Option<&Robot>, step_s: f64) -> Self {
        let Some(robot) = robot else {
            let entries = layout.action_dim();
            return Bounds { velocity: vec![f32::INFINITY; entries], position: vec![None; entries], step_s: step_s as f32 };
        };
        let known = |i: usize| layout.action_limits.get(i).copied().unwrap_or(robot.joints[i].velocity);
        let within = |most: f64| if f64::from(most as f32) > most { (most as f32).next_down() } else { most as f32 };
        let range = |[low, high]: [f64; 2]| [-within(-low), within(high)];
        Bounds {
            velocity: (0..robot.joints.len()).map(|i| within(known(i).min(robot.joints[i].velocity))).collect(),
            position: robot.joints.iter().map(|joint| (!joint.continuous).then(|| range(joint.limits))).collect(),
            step_s: step_s as f32,
        }
    }

    /// Lowest and highest position of each joint that something stops.
    pub fn position(&self) -> &[Option<[f32; 2]>] {
        &self.position
    }

    /// Brings `action` within the limits, at the joint positions `q`. A joint that is out of its range already may only come back.
    pub fn apply(&self, q: &[f32], action: &mut [f32]) -> Limited {
        let mut limited = Limited::default();
        for (i, command) in action.iter_mut().enumerate() {
            let most = self.velocity[i];
            if command.abs() > most {
                *command = command.clamp(-most, most);
                limited.velocity.push(i);
            }
            let Some([low, high]) = self.position[i] else { continue };
            let (down, up) = (((low - q[i]) / self.step_s).min(0.0), ((high - q[i]) / self.step_s).max(0.0));
            if *command < down || *command > up {
                *command = command.clamp(down, up);
                limited.position.push(i);
            }
        }
        limited
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::named;
    use crate::task::built_in::stack;

    #[test]
    fn commands_stay_within_speeds_and_ranges() {
        let robot = named("panda").expect("it is there").expect("it is sound");
        let bounds = Bounds::new(&stack().layout(&robot), Some(&robot), 0.05);
        let [low, high] = robot.joints[0].limits.map(|v| v as f32);
        let most = robot.joints[0].velocity as f32;
        let at = |q0: f32, asked: f32| {
            let mut q: Vec<f32> = robot.ready.iter().map(|v| *v as f32).collect();
            let mut action = vec![0.0; 9];
            (q[0], action[0]) = (q0, asked);
            let limited = bounds.apply(&q, &mut action);
            assert!(action[1..].iter().all(|v| *v == 0.0));
            (action[0], limited.velocity.len(), limited.position.len())
        };
        assert_eq!(at(0.0, 1.0), (1.0, 0, 0));
        assert_eq!(at(0.0, 100.0), (most, 1, 0));
        assert_eq!(at(0.0, f32::NEG_INFINITY), (-most, 1, 0));
        let (slowed, _, count) = at(high - 0.01, 1.0);
        assert!((slowed - 0.2).abs() < 1e-3 && count == 1, "{slowed}");
        assert_eq!(at(high - 0.01, -1.0), (-1.0, 0, 0));
        assert_eq!(at(high + 0.1, 1.0), (0.0, 0, 1));
        assert_eq!(at(low - 0.1, -1.0), (0.0, 0, 1));
        assert_eq!(at(low - 0.1, 1.0), (1.0, 0, 0));
    }

    #[test]
    fn a_joint_that_turns_freely_has_no_range() {
        let robot = named("jaco").expect("it is there").expect("it is sound");
        let bounds = Bounds::new(&stack().layout(&robot), Some(&robot), 0.05);
        for (joint, range) in robot.joints.iter().zip(bounds.position()) {
            assert_eq!(range.is_none(), joint.continuous, "{}", joint.name);
        }
        assert!(robot.joints.iter().any(|joint| joint.continuous));
    }
}
