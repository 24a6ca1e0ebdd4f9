//! A typed table with names, units and words: what metrics, plans and evaluation logs are before they become files.

/// Endings of column names and their units; the longest that fits counts.
const UNITS: [(&str, &str); 13] = [
    ("_rad_s2", "rad/s^2"),
    ("_rad_s", "rad/s"),
    ("_m_s2", "m/s^2"),
    ("_m_s", "m/s"),
    ("_n_m", "N m"),
    ("_rad", "rad"),
    ("_deg", "deg"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_ms", "ms"),
    ("_n", "N"),
    ("_m", "m"),
    ("_s", "s"),
];

/// The unit that a column's name carries (`speed_m_s` is in m/s).
pub fn unit_of(name: &str) -> Option<&'static str> {
    UNITS.iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, unit)| *unit)
}

/// The values of one column.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 64-bit floats.
    F64(Vec<f64>),
    /// Integers.
    I64(Vec<i64>),
    /// Flags.
    Bool(Vec<bool>),
    /// Text.
    Text(Vec<String>),
}

impl Values {
    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Values::F32(v) => v.len(),
            Values::F64(v) => v.len(),
            Values::I64(v) => v.len(),
            Values::Bool(v) => v.len(),
            Values::Text(v) => v.len(),
        }
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name, with the unit where it has one (`speed_m_s`).
    pub name: String,
    /// What it is, in a sentence; goes into the file's own metadata.
    pub doc: String,
    /// The values.
    pub values: Values,
}

/// Columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The columns, in order.
    pub columns: Vec<Column>,
}

impl Table {
    /// Adds a column.
    pub fn with(mut self, name: &str, doc: &str, values: Values) -> Self {
        debug_assert!(self.columns.first().is_none_or(|c| c.values.len() == values.len()), "column {name} has another length");
        self.columns.push(Column { name: name.into(), doc: doc.into(), values });
        self
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }

    /// A column by name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.name == name)
    }
}
