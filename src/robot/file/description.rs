//! What a robot's TOML file says.

use crate::robot::model::Robot;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The TOML file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Short name.
    pub name: String,
    /// The URDF, relative to this file.
    pub urdf: PathBuf,
    /// The joints of the arm, from the foot to the hand.
    pub arm: Vec<String>,
    /// The joints of the fingers.
    pub fingers: Vec<String>,
    /// Positions at which movable joints are held for good \[rad, m\].
    #[serde(default)]
    pub fixed: BTreeMap<String, f64>,
    /// The tool between the finger pads.
    pub tool: Tool,
    /// Where every episode begins: the arm's joints \[rad\].
    pub ready: Vec<f64>,
    /// Distances from the foot at which the level hand gets down to the table, near and far \[m\]: nothing is drawn nearer or farther.
    #[serde(default)]
    pub reach_m: Option<[f64; 2]>,
    /// The hand.
    pub hand: Hand,
    /// Joints of the arm that are pulled to a position where the tool's pose leaves them free \[rad\].
    #[serde(default)]
    pub posture: BTreeMap<String, f64>,
    /// What all motors of the arm and of the fingers add.
    #[serde(default)]
    pub motors: Motors,
    /// What is otherwise than in the URDF, by joint.
    #[serde(default)]
    pub joints: BTreeMap<String, JointOverride>,
    /// Collision primitives, by link, in place of the URDF's.
    #[serde(default)]
    pub shapes: BTreeMap<String, Vec<ShapeEntry>>,
    /// Directories of packages, for `package://NAME/...`, relative to this file.
    #[serde(default)]
    pub packages: BTreeMap<String, PathBuf>,
}

/// Where the tool is, in the frame of the link on which the last joint of the arm acts.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Tool point \[m\].
    pub xyz_m: [f64; 3],
    /// The tool's axes: those of the world when the hand points straight down at yaw 0 (roll, pitch, yaw) \[rad\].
    #[serde(default)]
    pub rpy_rad: [f64; 3],
}

/// The hand.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// Position of each finger in the open hand \[rad, m\].
    pub opened: Vec<f64>,
    /// Position of each finger that closed around nothing \[rad, m\].
    pub closed: Vec<f64>,
    /// Speed while they close, hold and open \[rad/s, m/s\].
    pub speed: f64,
}

/// What the motors add.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Motors {
    /// Those of the arm.
    pub arm: MotorEntry,
    /// Those of the fingers.
    pub fingers: MotorEntry,
}

/// What a motor and its gears add; what is not said is the URDF's, or none.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotorEntry {
    /// Reflected inertia \[kg m^2, kg\].
    pub armature: Option<f64>,
    /// Viscous damping \[N m s/rad, N s/m\].
    pub damping: Option<f64>,
    /// Dry friction \[N m, N\].
    pub friction: Option<f64>,
}

/// What is otherwise than in the URDF.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JointOverride {
    /// Lowest and highest position \[rad, m\].
    pub limits: Option<[f64; 2]>,
    /// Highest speed \[rad/s, m/s\].
    pub velocity: Option<f64>,
    /// Highest torque or force \[N m, N\].
    pub effort: Option<f64>,
    /// Reflected inertia of its motor \[kg m^2, kg\].
    pub armature: Option<f64>,
    /// Its viscous damping \[N m s/rad, N s/m\].
    pub damping: Option<f64>,
    /// Its dry friction \[N m, N\].
    pub friction: Option<f64>,
}

/// A collision primitive in its link's frame.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub enum ShapeEntry {
    /// Segment with a radius.
    Capsule {
        /// One end \[m\].
        from_m: [f64; 3],
        /// Other end \[m\].
        to_m: [f64; 3],
        /// \[m\].
        radius_m: f64,
    },
    /// A box.
    Box {
        /// Its centre \[m\].
        center_m: [f64; 3],
        /// Half of its edges \[m\].
        half_m: [f64; 3],
        /// Roll, pitch, yaw \[rad\].
        #[serde(default)]
        rpy_rad: [f64; 3],
    },
}

/// A robot that was read, and what is worth knowing about the reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Read {
    /// The robot.
    pub robot: Robot,
    /// What was replaced, left out or assumed.
    pub remarks: Vec<String>,
}

impl Description {
    /// Of the text of a file.
    ///
    /// # Errors
    /// Says which key is wrong, and what is allowed.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let table: toml::Table =
            text.parse().map_err(|e: toml::de::Error| format!("not valid TOML: {}", e.to_string().trim_end()))?;
        finite("", &toml::Value::Table(table.clone()))?;
        serde_path_to_error::deserialize(toml::Value::Table(table)).map_err(|e| match e.path().to_string() {
            key if key == "." => e.inner().to_string().trim_end().to_string(),
            key => format!("{key}: {}", e.inner().to_string().trim_end()),
        })
    }
}

/// TOML knows inf and nan; no number of a robot is one.
fn finite(key: &str, value: &toml::Value) -> Result<(), String> {
    let below = |part: &str| if key.is_empty() { part.to_string() } else { format!("{key}.{part}") };
    match value {
        toml::Value::Float(number) if !number.is_finite() => Err(format!("{key} is {number}, a finite number is needed")),
        toml::Value::Array(values) => values.iter().enumerate().try_for_each(|(i, value)| finite(&below(&i.to_string()), value)),
        toml::Value::Table(table) => table.iter().try_for_each(|(part, value)| finite(&below(part), value)),
        _ => Ok(()),
    }
}
