//! Statistics of numbers, also of those that do not fit into memory together: they come twice, some at a time.

use serde_json::{Map, Value, json};

/// Count, range, mean and standard deviation (ddof 0) of the finite numbers among those that came.
#[derive(Clone)]
pub(super) struct Running {
    finite: f64,
    others: u64,
    sum: f64,
    min: f64,
    max: f64,
    /// Squares of the distances from the mean, of those that came a second time.
    squares: f64,
}

impl Running {
    /// Of no number. A sum of floats begins at -0.
    pub(super) const NONE: Running =
        Running { finite: 0.0, others: 0, sum: -0.0, min: f64::INFINITY, max: f64::NEG_INFINITY, squares: -0.0 };

    /// Takes in a number.
    pub(super) fn add(&mut self, value: f64) {
        if !value.is_finite() {
            self.others += 1;
            return;
        }
        self.finite += 1.0;
        self.sum += value;
        (self.min, self.max) = (self.min.min(value), self.max.max(value));
    }

    /// Takes in a number once more, when all have come once.
    pub(super) fn add_again(&mut self, value: f64) {
        if value.is_finite() {
            self.squares += (value - self.sum / self.finite).powi(2);
        }
    }

    /// When all have come twice; `not_finite` appears when some numbers are not.
    pub(super) fn describe(&self) -> Map<String, Value> {
        let mut fields = Map::new();
        if self.finite > 0.0 {
            let (mean, std) = (self.sum / self.finite, (self.squares / self.finite).sqrt());
            let numbers = [("min", self.min), ("max", self.max), ("mean", mean), ("std", std)];
            fields.extend(numbers.map(|(key, value)| (key.to_string(), json!(value))));
        }
        if self.others > 0 {
            fields.insert("not_finite".into(), json!(self.others));
        }
        fields
    }
}

/// The statistics of all these numbers.
pub(super) fn statistics(values: impl Iterator<Item = f64> + Clone) -> Map<String, Value> {
    let mut running = Running::NONE;
    values.clone().for_each(|value| running.add(value));
    values.for_each(|value| running.add_again(value));
    running.describe()
}

/// The statistics of each entry of row-major rows that come twice, some at a time.
pub(super) struct Columns(Vec<Running>);

impl Columns {
    /// Of no rows.
    pub(super) const NONE: Columns = Columns(Vec::new());

    /// Takes in rows of this width.
    pub(super) fn add(&mut self, rows: &[f32], width: usize) {
        self.0.resize(width, Running::NONE);
        self.each(rows, Running::add);
    }

    /// Takes in the same rows once more.
    pub(super) fn add_again(&mut self, rows: &[f32]) {
        self.each(rows, Running::add_again);
    }

    fn each(&mut self, rows: &[f32], take: fn(&mut Running, f64)) {
        for row in rows.chunks_exact(self.0.len()) {
            self.0.iter_mut().zip(row).for_each(|(entry, value)| take(entry, f64::from(*value)));
        }
    }

    /// With their names.
    pub(super) fn describe(&self, names: &[String]) -> Vec<Value> {
        let entry = |(name, entry): (&String, &Running)| {
            let mut fields = entry.describe();
            fields.insert("name".into(), json!(name));
            Value::Object(fields)
        };
        names.iter().zip(&self.0).map(entry).collect()
    }
}

/// The statistics of each entry of row-major rows.
pub(super) fn by_entry(names: &[String], rows: &[f32]) -> Vec<Value> {
    let mut columns = Columns::NONE;
    columns.add(rows, names.len());
    columns.add_again(rows);
    columns.describe(names)
}
