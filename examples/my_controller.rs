//! A controller of your own in hilt's simulator: it brings the tool over the block. `cargo run --release --example my_controller`

use hilt::config::{ChosenTask, Pipeline, Preset, Source};
use hilt::eval::Rollouts;
use hilt::interrupt::Interrupt;
use hilt::joints::Joints;
use hilt::sim::Controller;
use hilt::state::Action;
use hilt::tasks::Observation;
use nalgebra::Vector3;

/// Gain of the error \[1/s\], and the height over the block \[m\].
const GAIN_PER_S: f64 = 4.0;
const ABOVE_M: f64 = 0.15;

struct Reach;

fn error_m(seen: &Observation) -> Vector3<f64> {
    Vector3::from(seen.objects[0].pose.position_m) + Vector3::new(0.0, 0.0, ABOVE_M) - Vector3::from(seen.tool_m)
}

impl Controller for Reach {
    fn command(&mut self, seen: &Observation) -> Action {
        let (_, jacobian) = seen.robot.tool_jacobian(&seen.state.q);
        let linear = jacobian.rows(0, 3).into_owned();
        let inverse = linear.pseudo_inverse(1e-3).expect("the threshold is not negative");
        let velocities = inverse * error_m(seen) * GAIN_PER_S;
        // The arm's joints come first; the fingers stand still.
        Joints::from_fn(seen.robot.joints.len(), |i| velocities.get(i).copied().unwrap_or(0.0))
    }
}

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let task = ChosenTask::read("pick-up")?;
    let pipeline = Pipeline::load(&Source::BuiltIn(task, Preset::Best), &[])?;
    let rollouts = Rollouts::evaluation(&pipeline, 0, 60);
    for index in 0..3 {
        let episode = rollouts.play(index, &rollouts.scene(index)?, &mut Reach, &Interrupt::default())?;
        let (tool, block) = (episode.scene.robot.tool_pose(&episode.last.state.q), episode.last.objects[0].pose.position_m);
        let off_m = (Vector3::from(block) + Vector3::new(0.0, 0.0, ABOVE_M) - tool.translation.vector).norm();
        println!("episode {index}: after {} steps the tool is {:.1} mm off", episode.steps.len(), 1e3 * off_m);
        assert!(off_m < 0.02, "it should be there by now");
    }
    Ok(())
}
