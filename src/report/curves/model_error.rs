//! The error of a dynamics network by groups of the state, beside that of a state that does not change: bars on a terminal, and a picture.

use super::sources::{ends_in, files_in, stem};
use super::terminal::{Style, painted};
use crate::data::table_file;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::report::chart::{Datum, LOOKS, Picture, Row, Rows, tick};
use crate::table::{Table, Values};
use std::path::{Path, PathBuf};

/// Ending of the tables of errors that `hilt pretrain` writes.
const ENDING: &str = ".errors.parquet";
/// Columns of a table begin with the model whose errors they hold.
const NETWORK: &str = "network_";
const UNCHANGED: &str = "unchanged_";
/// Characters of a share and an error behind a bar; of a share alone, on terminals with fewer characters than [`NARROW`].
const NUMBERS: usize = 24;
const SHARE: usize = 10;
const NARROW: usize = 70;

/// The errors of one network.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelErrors {
    /// Its name beside the others.
    pub name: String,
    /// How far ahead, in words: "1 step", "10 steps".
    pub horizons: Vec<String>,
    /// Groups of the state.
    pub groups: Vec<GroupErrors>,
}

/// Errors of one group.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupErrors {
    /// Its name.
    pub name: String,
    /// Unit of its errors.
    pub unit: String,
    /// RMS error of the network at each horizon, and its share of the error that a state has which does not change.
    pub errors: Vec<[f64; 2]>,
}

/// Whether a file is such a table, by its name.
pub fn holds_model_errors(path: &Path) -> bool {
    ends_in(path, &[ENDING])
}

/// The tables among the files that are named, and those of the runs.
///
/// # Errors
/// [`Error::Input`] for a table that holds something else; what reading returns.
pub fn model_errors(named: &[PathBuf], interrupt: &Interrupt) -> Result<Vec<ModelErrors>> {
    let mut found = Vec::new();
    for path in named {
        interrupt.check()?;
        let mut files = vec![path.clone()];
        if path.is_dir() {
            files = files_in(path)?;
            files.sort();
        }
        for file in files.iter().filter(|file| holds_model_errors(file)) {
            let (table, _) = table_file::read(file)?;
            found.push(of_table(name_of(file, named.len() > 1), &table).map_err(|why| Error::input(file, why))?);
        }
    }
    Ok(found)
}

/// `dynamics` of `runs/stack/dynamics.errors.parquet`; of several, with the run before.
fn name_of(file: &Path, several: bool) -> String {
    let (stem, run) = (stem(file), file.parent().and_then(Path::file_name).filter(|_| several));
    run.map_or(stem.clone(), |run| format!("{} {stem}", run.to_string_lossy()))
}

fn of_table(name: String, table: &Table) -> std::result::Result<ModelErrors, String> {
    let refused = || "holds no errors of a dynamics network; expected what hilt pretrain writes beside it".to_string();
    let texts = |name: &str| match table.column(name).map(|column| &column.values) {
        Some(Values::Text(texts)) => Ok(texts.clone()),
        _ => Err(refused()),
    };
    let numbers = |name: &str| match table.column(name).map(|column| &column.values) {
        Some(Values::F64(numbers)) => Ok(numbers.clone()),
        _ => Err(refused()),
    };
    let horizons: Vec<&str> = table.columns.iter().filter_map(|column| column.name.strip_prefix(NETWORK)).collect();
    if horizons.is_empty() {
        return Err(refused());
    }
    let mut groups: Vec<GroupErrors> = texts("group")?
        .into_iter()
        .zip(texts("unit")?)
        .map(|(name, unit)| GroupErrors { name, unit, errors: Vec::new() })
        .collect();
    for horizon in &horizons {
        let (network, unchanged) = (numbers(&format!("{NETWORK}{horizon}"))?, numbers(&format!("{UNCHANGED}{horizon}"))?);
        for (group, (error, still)) in groups.iter_mut().zip(network.into_iter().zip(unchanged)) {
            group.errors.push([error, error / still]);
        }
    }
    Ok(ModelErrors { name, horizons: horizons.iter().map(|said| said.replace('_', " ")).collect(), groups })
}

const TITLE: &str = "as a share of that of an unchanged state";

/// Bars: a block a horizon, in it a line for each group and network.
pub fn draw_errors(all: &[ModelErrors], style: &Style) -> String {
    let names = all.iter().flat_map(|of| &of.groups).map(|group| group.name.chars().count()).max().unwrap_or(0);
    let numbers = if style.width < NARROW { SHARE } else { NUMBERS };
    let room = style.width.saturating_sub(names + 2 + numbers).max(1);
    let cut = |line: String| line.chars().take(style.width).collect::<String>();
    let mut text = String::new();
    let horizons: Vec<&String> = all.first().map(|of| of.horizons.iter().collect()).unwrap_or_default();
    for (at, horizon) in horizons.into_iter().enumerate() {
        text += &format!("{}\n", cut(format!("model error after {horizon}, {TITLE}")));
        for (source, of) in all.iter().enumerate() {
            if all.len() > 1 {
                text += &format!("{}\n", cut(of.name.clone()));
            }
            for group in &of.groups {
                let Some([error, share]) = group.errors.get(at).copied() else { continue };
                let filled = ((share * room as f64).round().max(0.0) as usize).min(room);
                let mark = if style.unicode { "\u{2588}" } else { "#" };
                let bar = painted(&mark.repeat(filled), source, style) + &" ".repeat(room - filled);
                let behind = if share.is_finite() {
                    format!("{:>6.1} % {} {}", 100.0 * share, tick(error), group.unit)
                } else {
                    "-".into()
                };
                let behind = cut_to(numbers - 1, &behind);
                text += format!("{:names$} {bar} {behind}", group.name).trim_end();
                text.push('\n');
            }
        }
    }
    text
}

fn cut_to(most: usize, text: &str) -> String {
    text.chars().take(most).collect()
}

/// The same as a picture: a panel a horizon.
pub fn errors_picture(all: &[ModelErrors]) -> Picture {
    let mut rows: Vec<Row> = Vec::new();
    for (source, of) in all.iter().enumerate() {
        for group in &of.groups {
            let data =
                group.errors.iter().enumerate().filter(|(_, [_, share])| share.is_finite()).map(|(panel, [_, share])| Datum {
                    panel,
                    look: source % LOOKS,
                    series: of.name.clone(),
                    value: *share,
                    interval: [*share; 2],
                    singles: Vec::new(),
                });
            match rows.iter_mut().find(|row| row.name == group.name) {
                Some(row) => row.data.extend(data),
                None => rows.push(Row { name: group.name.clone(), data: data.collect() }),
            }
        }
    }
    Rows {
        id: "model-error".into(),
        title: "Error of the dynamics network".into(),
        description: format!("For each group of the state, its error {TITLE}"),
        x_label: "share of the error of a state that does not change".into(),
        note: "open loop, on the validation demos; what is worse than no change stands at the right edge".into(),
        panels: all.first().map(|of| of.horizons.iter().map(|said| format!("after {said}")).collect()).unwrap_or_default(),
        rows,
    }
    .draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table::default()
            .with("group", "", Values::Text(vec!["arm_q".into(), "block_rotation".into()]))
            .with("unit", "", Values::Text(vec!["rad".into(); 2]))
            .with("network_1_step", "", Values::F64(vec![0.01, 0.3]))
            .with("network_10_steps", "", Values::F64(vec![0.1, f64::NAN]))
            .with("unchanged_1_step", "", Values::F64(vec![0.04, 0.1]))
            .with("unchanged_10_steps", "", Values::F64(vec![0.2, f64::NAN]))
    }

    #[test]
    fn a_bar_is_the_share_and_no_line_is_longer_than_the_terminal() {
        let errors = of_table("dynamics".into(), &table()).expect("errors");
        assert_eq!(errors.horizons, ["1 step", "10 steps"]);
        assert_eq!(errors.groups[0].errors, [[0.01, 0.25], [0.1, 0.5]]);
        for width in [40, 80, 200] {
            let style = Style { width, height: 7, colour: false, unicode: false };
            let text = draw_errors(std::slice::from_ref(&errors), &style);
            assert!(text.is_ascii() && text.lines().all(|line| line.len() <= width), "{width}: {text}");
            let room = width - "block_rotation".len() - 2 - if width < NARROW { SHARE } else { NUMBERS };
            let filled: Vec<usize> = text.lines().map(|line| line.matches('#').count()).collect();
            assert_eq!(
                filled,
                [0, (room as f64 / 4.0).round() as usize, room, 0, (room as f64 / 2.0).round() as usize, 0],
                "{text}"
            );
        }
        let svg = errors_picture(&[errors.clone(), errors]).to_svg();
        assert_eq!(svg.matches("class=\"mean\"").count(), 6, "a share that is no number is no mark");
    }

    #[test]
    fn another_table_is_refused() {
        let epochs = Table::default().with("stage", "", Values::Text(vec![]));
        assert!(of_table("a".into(), &epochs).expect_err("refused").contains("hilt pretrain"));
    }
}
