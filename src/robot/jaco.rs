//! The Kinova Jaco j2n6s300 in numbers. Source, unless said otherwise: Kinova's published `kinova_description` URDF/xacro.

use crate::state::JOINTS;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI};

/// Links that move, plus the fixed base: index 0 is the base, 1..=6 the arm's links (6 is the hand), 7..=9 the fingers.
pub const LINKS: usize = JOINTS + 1;
/// Index of the hand's link.
pub const HAND_LINK: usize = 6;
/// URDF names of the links; also the `child_frame_id` of recorded transforms.
pub const LINK_NAMES: [&str; LINKS] = [
    "j2n6s300_link_base",
    "j2n6s300_link_1",
    "j2n6s300_link_2",
    "j2n6s300_link_3",
    "j2n6s300_link_4",
    "j2n6s300_link_5",
    "j2n6s300_link_6",
    "j2n6s300_link_finger_1",
    "j2n6s300_link_finger_2",
    "j2n6s300_link_finger_3",
];

/// A revolute joint about the child's local z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSpec {
    /// Index of the parent link.
    pub parent: usize,
    /// Origin in the parent's frame \[m\].
    pub xyz_m: [f64; 3],
    /// Orientation in the parent's frame, roll pitch yaw \[rad\].
    pub rpy_rad: [f64; 3],
}

const fn joint(parent: usize, xyz_m: [f64; 3], rpy_rad: [f64; 3]) -> JointSpec {
    JointSpec { parent, xyz_m, rpy_rad }
}

/// The nine joints; joint i moves link i + 1.
pub const JOINT_SPECS: [JointSpec; JOINTS] = [
    joint(0, [0.0, 0.0, 0.15675], [0.0, PI, 0.0]),
    joint(1, [0.0, 0.0016, -0.11875], [-FRAC_PI_2, 0.0, PI]),
    joint(2, [0.0, -0.410, 0.0], [0.0, PI, 0.0]),
    joint(3, [0.0, 0.2073, -0.0114], [-FRAC_PI_2, 0.0, PI]),
    joint(4, [0.0, -0.03703, -0.06414], [FRAC_PI_3, 0.0, PI]),
    joint(5, [0.0, -0.03703, -0.06414], [FRAC_PI_3, 0.0, PI]),
    joint(6, [0.00279, 0.03126, -0.11467], [-1.7047873384941834, 0.6476144647144773, 1.67317415161155]),
    joint(6, [0.02226, -0.02707, -0.11482], [-FRAC_PI_2, 0.649262481663582, -1.38614049188413]),
    joint(6, [-0.02226, -0.02707, -0.11482], [-FRAC_PI_2, 0.649262481663582, -1.75545216211587]),
];

/// A continuous joint turns freely; planning keeps it within one turn to either side of a full turn.
const FREE: [f64; 2] = [-2.0 * PI, 4.0 * PI];

/// Joint position limits, low and high \[rad\].
pub const POSITION_LIMITS_RAD: [[f64; 2]; JOINTS] =
    [FREE, [47.0 * DEG, 313.0 * DEG], [19.0 * DEG, 341.0 * DEG], FREE, FREE, FREE, [0.0, 1.51], [0.0, 1.51], [0.0, 1.51]];

const DEG: f64 = PI / 180.0;

/// Joint velocity limits \[rad/s\]: 36 deg/s (joints 1-3), 48 deg/s (4-6), 1 rad/s (fingers).
pub const VELOCITY_LIMITS_RAD_S: [f64; JOINTS] =
    [36.0 * DEG, 36.0 * DEG, 36.0 * DEG, 48.0 * DEG, 48.0 * DEG, 48.0 * DEG, 1.0, 1.0, 1.0];

/// Joint torque limits \[N m\]; the fingers' 1.2 is below the URDF's 2 (measured to hold a 0.1 kg cube without crushing it).
pub const TORQUE_LIMITS_N_M: [f64; JOINTS] = [40.0, 80.0, 40.0, 20.0, 20.0, 20.0, 1.2, 1.2, 1.2];

/// Mass, centre of mass and principal inertia of a link, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkInertia {
    /// \[kg\].
    pub mass_kg: f64,
    /// \[m\].
    pub com_m: [f64; 3],
    /// Diagonal about the centre of mass \[kg m^2\].
    pub inertia_kg_m2: [f64; 3],
}

const fn inertia(mass_kg: f64, com_m: [f64; 3], inertia_kg_m2: [f64; 3]) -> LinkInertia {
    LinkInertia { mass_kg, com_m, inertia_kg_m2 }
}

/// A finger with its tip welded on: two links of 0.01 kg, centres at x = 22 mm and 44 + 22 mm; inertia by the parallel axis theorem.
const FINGER: LinkInertia = inertia(0.02, [0.044, -0.0015, 0.0], [1.6e-6, 1.13e-5, 1.13e-5]);

/// Inertia of the ten links.
pub const LINK_INERTIA: [LinkInertia; LINKS] = [
    inertia(0.46784, [0.0, 0.0, 0.1255], [9.51e-4, 9.51e-4, 3.74e-4]),
    inertia(0.7477, [0.0, -0.002, -0.0605], [1.520e-3, 1.520e-3, 5.98e-4]),
    inertia(0.99, [0.0, -0.2065, -0.01], [1.050e-2, 7.92e-4, 1.050e-2]),
    inertia(0.6763, [0.0, 0.081, -0.0086], [1.420e-3, 3.04e-4, 1.420e-3]),
    inertia(0.426367, [0.0, -0.037, -0.0642], [7.74e-5, 7.74e-5, 1.43e-4]),
    inertia(0.426367, [0.0, -0.037, -0.0642], [7.74e-5, 7.74e-5, 1.43e-4]),
    inertia(0.99, [0.0, 0.0, -0.06], [3.45e-4, 3.45e-4, 5.82e-4]),
    FINGER,
    FINGER,
    FINGER,
];

/// A collision primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Segment with a radius.
    Capsule {
        /// One end \[m\].
        from_m: [f64; 3],
        /// Other end \[m\].
        to_m: [f64; 3],
        /// \[m\].
        radius_m: f64,
    },
    /// Axis-aligned box in the link's frame.
    Box {
        /// \[m\].
        center_m: [f64; 3],
        /// \[m\].
        half_m: [f64; 3],
    },
}

/// A primitive and the link that carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkShape {
    /// Index of the link.
    pub link: usize,
    /// In the link's frame.
    pub shape: Shape,
}

const fn capsule(link: usize, from_m: [f64; 3], to_m: [f64; 3], radius_m: f64) -> LinkShape {
    LinkShape { link, shape: Shape::Capsule { from_m, to_m, radius_m } }
}

const fn cuboid(link: usize, center_m: [f64; 3], half_m: [f64; 3]) -> LinkShape {
    LinkShape { link, shape: Shape::Box { center_m, half_m } }
}

/// Collision primitives of the arm, fitted to the bounding boxes of Kinova's meshes. A finger carries a proximal and a distal box.
pub const LINK_SHAPES: [LinkShape; 13] = [
    capsule(0, [0.0, 0.0, 0.04], [0.0, 0.0, 0.115], 0.04),
    capsule(1, [0.0, 0.0, -0.03], [0.0, 0.0, -0.12], 0.04),
    capsule(2, [0.0, 0.0, -0.02], [0.0, -0.41, -0.02], 0.04),
    capsule(3, [0.0, 0.0, -0.012], [0.0, 0.17, -0.012], 0.036),
    capsule(4, [0.0, 0.0, -0.02], [0.0, -0.03, -0.058], 0.032),
    capsule(5, [0.0, 0.0, -0.02], [0.0, -0.03, -0.058], 0.032),
    cuboid(6, [0.0, 0.0, -0.058], [0.04, 0.042, 0.045]),
    cuboid(7, [0.0215, -0.0085, 0.0], [0.0225, 0.009, 0.011]),
    cuboid(7, [0.0655, -0.0075, 0.0], [0.021, 0.006, 0.0105]),
    cuboid(8, [0.0215, -0.0085, 0.0], [0.0225, 0.009, 0.011]),
    cuboid(8, [0.0655, -0.0075, 0.0], [0.021, 0.006, 0.0105]),
    cuboid(9, [0.0215, -0.0085, 0.0], [0.0225, 0.009, 0.011]),
    cuboid(9, [0.0655, -0.0075, 0.0], [0.021, 0.006, 0.0105]),
];

/// Tool point between the finger pads, in the hand's frame \[m\] (measured: pads are nearly parallel there at 0.9 rad).
pub const TOOL_IN_HAND_M: [f64; 3] = [0.0, 0.0024, -0.183];

/// Where every episode begins \[rad\]: tool at x .45, y 0, z .30 m, hand down (yaw 0), fingers pre-shaped for a 5 cm cube.
pub const READY_Q_RAD: [f64; JOINTS] =
    [3.31904, 3.58190, 1.69441, 3.57322, 4.79439, 3.75067, PRESHAPE_RAD, PRESHAPE_RAD, PRESHAPE_RAD];

/// Finger angle of the open hand \[rad\]: room of 4 to 5 cm on each side of a 5 cm cube.
pub const PRESHAPE_RAD: f64 = 0.4;
