//! Shapes of objects.

/// Thickness of a bin's walls \[m\].
pub const BIN_WALL_M: f64 = 0.005;

/// What an object looks like; its origin is the middle of its height and footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box: full edges x y z \[m\].
    Box([f64; 3]),
    /// A cylinder that stands upright.
    Cylinder {
        /// \[m\].
        radius_m: f64,
        /// \[m\].
        height_m: f64,
    },
    /// Four walls around an open space, fixed on the table.
    Bin {
        /// Space between the walls along x and y \[m\].
        inner_m: [f64; 2],
        /// Height of the walls \[m\].
        height_m: f64,
    },
}

impl Shape {
    /// Half of its extent along x, y and z \[m\].
    pub fn half_m(&self) -> [f64; 3] {
        match *self {
            Shape::Box(size) => size.map(|edge| edge / 2.0),
            Shape::Cylinder { radius_m, height_m } => [radius_m, radius_m, height_m / 2.0],
            Shape::Bin { inner_m: [x, y], height_m } => [x / 2.0 + BIN_WALL_M, y / 2.0 + BIN_WALL_M, height_m / 2.0],
        }
    }

    /// Half of its height \[m\].
    pub fn half_height_m(&self) -> f64 {
        self.half_m()[2]
    }

    /// The larger half of its footprint's edges \[m\].
    pub fn half_width_m(&self) -> f64 {
        let [x, y, _] = self.half_m();
        x.max(y)
    }

    /// Whether it stays where it is.
    pub fn is_fixed(&self) -> bool {
        matches!(self, Shape::Bin { .. })
    }

    /// Boxes that fill it, or hold it: centre in its frame and half edges \[m\].
    pub fn boxes_m(&self) -> Vec<([f64; 3], [f64; 3])> {
        let Shape::Bin { inner_m: [inner_x, inner_y], .. } = *self else { return vec![([0.0; 3], self.half_m())] };
        let ([x, _, z], half_wall) = (self.half_m(), BIN_WALL_M / 2.0);
        let (at_x, at_y) = (inner_x / 2.0 + half_wall, inner_y / 2.0 + half_wall);
        vec![
            ([at_x, 0.0, 0.0], [half_wall, inner_y / 2.0, z]),
            ([-at_x, 0.0, 0.0], [half_wall, inner_y / 2.0, z]),
            ([0.0, at_y, 0.0], [x, half_wall, z]),
            ([0.0, -at_y, 0.0], [x, half_wall, z]),
        ]
    }
}
