//! Where a training stands, in a line.

use super::sources::{PLACE, Source, numbers};
use crate::table::Values;

/// Its last epoch: "hil epoch 3: l_bc 0.0231, alpha 0.8".
pub fn latest(source: &Source) -> String {
    let metrics = &source.metrics;
    let Some(row) = metrics.rows().checked_sub(1) else { return format!("{}: no epoch yet", source.name) };
    let text = |name: &str| match metrics.column(name).map(|column| &column.values) {
        Some(Values::Text(v)) => v[row].clone(),
        Some(Values::I64(v)) => v[row].to_string(),
        _ => String::new(),
    };
    let known = metrics.columns.iter().filter(|column| !PLACE.contains(&column.name.as_str())).filter_map(|column| {
        let value = numbers(&column.values)?[row];
        value.is_finite().then(|| format!("{} {value:.4}", column.name))
    });
    format!("{} epoch {}: {}", text("stage"), text("epoch"), known.collect::<Vec<_>>().join(", "))
}
