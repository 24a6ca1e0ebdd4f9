//! A description as a TOML file, with what was guessed and what is to be looked at.

use crate::robot::file::description::{Description, JointOverride, MotorEntry};
use crate::robot::motors::FINGER_FRICTION;
use std::fmt::Write;

/// A description, and what is worth saying about it.
pub struct Drafted {
    /// The description.
    pub description: Description,
    /// Room between the fingers of the open hand \[m\].
    pub room_m: f64,
    /// Whether the ready pose is one; else it is the middle of all limits.
    pub ready_found: bool,
}

/// The file.
pub fn text(drafted: &Drafted) -> String {
    let Drafted { description, room_m, ready_found } = drafted;
    let mut text = String::new();
    let mut line = |words: &str| writeln!(text, "{words}").expect("a text takes all lines");
    line(
        "# Drafted from the URDF alone. Look at it with `hilt robot check THIS_FILE --png PICTURE.png`, and correct what is doubtful.",
    );
    line(&format!("name = {}", quoted(&description.name)));
    line(&format!("urdf = {}", quoted(&description.urdf.display().to_string())));
    line(&format!("arm = {}", names(&description.arm)));
    line(&format!("fingers = {}", names(&description.fingers)));
    match description.reach_m {
        Some(reach) => {
            line("# Where the level hand gets down to the table straight ahead, less 5 cm at both ends.");
            line(&format!("reach_m = {}", numbers(&reach)));
        }
        None => line("# reach_m = [near, far]: the hand was not seen to get down to the table."),
    }
    line(match ready_found {
        true => "# The hand down, in front of the foot.",
        false => {
            "# The hand was nowhere found to point straight down in front of the foot: this is the middle of all limits. Correct tool.rpy_rad first."
        }
    });
    line(&format!("ready = {}", numbers(&description.ready)));
    line("\n# Between the finger tips, 1 cm above them; the fingers close along its y axis.");
    line("[tool]");
    line(&format!("xyz_m = {}", numbers(&description.tool.xyz_m)));
    line(&format!("rpy_rad = {}", numbers(&description.tool.rpy_rad)));
    line(&format!("\n# Open: {:.0} mm between the fingers (a cube has 50). Closed: around nothing.", room_m * 1e3));
    line("[hand]");
    line(&format!("opened = {}", numbers(&description.hand.opened)));
    line(&format!("closed = {}", numbers(&description.hand.closed)));
    line(&format!("speed = {}", number(description.hand.speed)));
    if !description.fixed.is_empty() {
        line(
            "\n# Joints that are neither the arm's nor a finger's. Those of a linkage are held half way, where the pads should stand parallel around a block.",
        );
        line("[fixed]");
        description.fixed.iter().for_each(|(name, position)| line(&format!("{} = {}", key(name), number(*position))));
    }
    if !description.posture.is_empty() {
        line("\n# More than six joints: this one settles what the tool's pose leaves free.");
        line("[posture]");
        description.posture.iter().for_each(|(name, position)| line(&format!("{} = {}", key(name), number(*position))));
    }
    line(&format!(
        "\n# What to begin with where nothing is published: reflected inertia as simulators have it, and dry friction of the fingers of {FINGER_FRICTION} of\n\
         # their effort, as gears have that cannot be pushed back."
    ));
    for (part, MotorEntry { armature, damping, friction }) in
        [("arm", description.motors.arm), ("fingers", description.motors.fingers)]
    {
        line(&format!("[motors.{part}]"));
        for (key, value) in [("armature", armature), ("damping", damping), ("friction", friction)] {
            value.into_iter().for_each(|value| line(&format!("{key} = {}", number(value))));
        }
    }
    for (name, JointOverride { velocity, effort, .. }) in &description.joints {
        line("\n# What the URDF does not say, or where it says that the finger presses harder than any gripper.");
        line(&format!("[joints.{}]", key(name)));
        for (key, value) in [("velocity", velocity), ("effort", effort)] {
            value.iter().for_each(|value| line(&format!("{key} = {}", number(*value))));
        }
    }
    text
}

/// To a hundredth of a millimetre, a ten-thousandth of a degree.
fn number(value: f64) -> String {
    let text = format!("{value:.5}");
    let short = text.trim_end_matches('0');
    let short = if short.ends_with('.') { format!("{short}0") } else { short.to_string() };
    if short == "-0.0" { "0.0".into() } else { short }
}

fn numbers(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", "))
}

fn names(names: &[String]) -> String {
    format!("[{}]", names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", "))
}

fn quoted(name: &str) -> String {
    toml::Value::from(name).to_string()
}

/// As a key of TOML, in quotes where it must be.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { name.into() } else { quoted(name) }
}
