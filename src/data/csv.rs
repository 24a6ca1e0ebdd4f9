//! CSV: tables, datasets and recordings as text that any program reads. The first line names the columns, with their units where they have one; numbers
//! have as many digits as give the same bits back.

use super::{dataset, recording, table_file};
use crate::data::dataset::foreign::is_foreign;
use crate::data::peek::{Format, peek};
use crate::demo::{Contacts, Demo, Episode, Step};
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::state::CONTROL_DT_S;
use crate::table::{Table, Values};
use csv::{ErrorKind, Writer};
use std::io::Write;
use std::path::Path;

/// Before the entries of an action that was asked for.
const COMMANDED: &str = "commanded.";
/// Before those that the motors were given.
const EXECUTED: &str = "executed.";

/// Writes what stands at `path` into `out`: a table of hilt, a recording, or a dataset of hilt's, a row a frame.
///
/// # Errors
/// [`Error::Input`] for anything else and for what its own reader refuses; [`Error::Io`] when `out`, called `to`, refuses.
pub fn write(path: &Path, to: &Path, out: &mut dyn Write) -> Result<()> {
    let mut lines = Lines { writer: Writer::from_writer(out), to };
    if path.is_dir() {
        frames(path, &mut lines)?;
    } else {
        match peek(path).map_err(|e| Error::io(path, "read", e))?.format {
            Format::Mcap => steps(path, &mut lines)?,
            Format::Parquet => rows(path, &mut lines)?,
            _ => return Err(Error::input(path, "is neither a table (Parquet), a recording (MCAP) nor a dataset of hilt")),
        }
    }
    lines.writer.flush().map_err(|e| Error::io(to, "write", e))
}

struct Lines<'a> {
    writer: Writer<&'a mut dyn Write>,
    to: &'a Path,
}

impl Lines<'_> {
    fn line<T: AsRef<[u8]>>(&mut self, cells: impl IntoIterator<Item = T>) -> Result<()> {
        self.writer.write_record(cells).map_err(|e| match e.into_kind() {
            // Its kind tells a reader that has seen enough from a full disk.
            ErrorKind::Io(source) => Error::io(self.to, "write", source),
            other => Error::io(self.to, "write", std::io::Error::other(format!("{other:?}"))),
        })
    }
}

fn rows(path: &Path, lines: &mut Lines) -> Result<()> {
    let reader = table_file::Reader::open(path)?;
    lines.line(reader.no_rows()?.columns.iter().map(|column| column.name.as_str()))?;
    for piece in reader.tables()? {
        let piece: Table = piece?;
        for row in 0..piece.rows() {
            lines.line(piece.columns.iter().map(|column| cell(&column.values, row)))?;
        }
    }
    Ok(())
}

fn cell(values: &Values, row: usize) -> String {
    match values {
        Values::F32(v) => v[row].to_string(),
        Values::F64(v) => v[row].to_string(),
        Values::I64(v) => v[row].to_string(),
        Values::Bool(v) => v[row].to_string(),
        Values::Text(v) => v[row].clone(),
    }
}

/// Names of the entries of a state, of the action that was asked for and of that which the motors were given.
fn entries(layout: &Layout) -> Vec<String> {
    let before = |with: &'static str, names: Vec<String>| names.into_iter().map(move |name| format!("{with}{name}"));
    let actions = || dataset::names(&layout.action);
    dataset::names(&layout.state).into_iter().chain(before(COMMANDED, actions())).chain(before(EXECUTED, actions())).collect()
}

/// The last state of an episode has no action.
fn frames(root: &Path, lines: &mut Lines) -> Result<()> {
    if is_foreign(root) {
        let message = "is a dataset of another program: its Parquet files are tables already, which pandas and DuckDB read";
        return Err(Error::input(root, message));
    }
    if !root.join("meta").is_dir() && root.join(dataset::TRAIN).is_dir() {
        return Err(Error::input(root, format!("holds two datasets; name one: {}", root.join(dataset::TRAIN).display())));
    }
    let mut number = 0;
    dataset::each(root, |episode| {
        let demo: &Demo = &episode.demo;
        if number == 0 {
            let first = ["episode", "source_episode", "step", "time_s"].map(String::from);
            let last = ["reward", "success"].map(String::from);
            lines.line(first.into_iter().chain(entries(demo.layout())).chain(last))?;
        }
        for t in 0..=demo.len() {
            let at_end = t == demo.len();
            let mut cells = vec![number.to_string(), episode.source_index.to_string(), t.to_string(), seconds(t)];
            cells.extend(demo.state(t).iter().map(f32::to_string));
            let actions = [demo.actions(), demo.executed()].map(|all| all.len() / demo.len());
            if at_end {
                cells.extend(vec![String::new(); actions.iter().sum()]);
            } else {
                cells.extend(demo.action(t).iter().chain(demo.executed_action(t)).map(f32::to_string));
            }
            cells.push(episode.rewards.get(t).map_or(String::new(), f32::to_string));
            cells.push((at_end && episode.success).to_string());
            lines.line(cells)?;
        }
        number += 1;
        Ok(())
    })?;
    Ok(())
}

fn steps(path: &Path, lines: &mut Lines) -> Result<()> {
    let (episode, _) = recording::read(path)?;
    let task = &episode.scene.task;
    let mut header: Vec<String> = ["episode", "step", "time_s", "phase"].map(String::from).to_vec();
    header.extend(entries(&task.layout(&episode.scene.robot)));
    header.extend(task.objects.iter().map(|object| format!("{}.speed_m_s", object.name)));
    header.extend(touch_names(&episode));
    header.extend(task.condition_names().into_iter().map(|name| format!("condition.{name}")));
    header.push("reward".into());
    lines.line(&header)?;
    for (t, step) in episode.steps.iter().chain([&episode.last]).enumerate() {
        let mut cells = vec![episode.index.to_string(), t.to_string(), seconds(t)];
        cells.push(step.phase.map_or("", |phase| phase.name()).into());
        cells.extend(step.state.to_row().iter().map(f32::to_string));
        cells.extend(actions(step, t == episode.steps.len()));
        cells.extend(step.objects.iter().map(|object| object.speed_m_s.to_string()));
        cells.extend(touches(&step.contacts));
        cells.extend(step.conditions.iter().map(bool::to_string));
        cells.push(step.reward.to_string());
        lines.line(&cells)?;
    }
    Ok(())
}

fn actions(step: &Step, at_end: bool) -> Vec<String> {
    let all = step.commanded.iter().chain(step.executed.iter());
    all.map(|v| if at_end { String::new() } else { v.to_string() }).collect()
}

/// Names of what [`touches`] tells.
fn touch_names(episode: &Episode) -> Vec<String> {
    let fingers = episode.last.contacts.objects.first().map_or(0, |touch| touch.fingers_n.iter().count());
    let of = |name: &str| {
        let forces = (1..=fingers).map(|finger| format!("{name}.finger_{finger}_n")).collect::<Vec<_>>();
        forces.into_iter().chain([format!("{name}.on_table")])
    };
    let robot = ["robot_hits_obstacle", "robot_hits_table"].map(String::from);
    episode.scene.task.objects.iter().flat_map(|object| of(&object.name).collect::<Vec<_>>()).chain(robot).collect()
}

fn touches(contacts: &Contacts) -> Vec<String> {
    let objects = contacts.objects.iter().flat_map(|touch| {
        let forces: Vec<String> = touch.fingers_n.iter().map(f64::to_string).collect();
        forces.into_iter().chain([touch.table.to_string()])
    });
    objects.chain([contacts.robot_obstacle.to_string(), contacts.robot_table.to_string()]).collect()
}

/// Since the beginning of the episode \[s\].
fn seconds(step: usize) -> String {
    (step as f64 * CONTROL_DT_S).to_string()
}
