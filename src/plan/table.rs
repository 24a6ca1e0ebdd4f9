//! Plans as a table and back.

use super::{Plan, Waypoint};
use crate::config::{MOST_STEPS, check_scene};
use crate::demo::{LARGEST_NUMBER, Phase};
use crate::error::Error;
use crate::joints::Joints;
use crate::robot::Robot;
use crate::robot::model::Joint;
use crate::scene::Scene;
use crate::table::{Table, Values};
use crate::task::Task;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Plans of a robot as a table, one row per waypoint: `episode`, `step`, `goal`, `phase`, `<joint>.q_rad` and `<joint>.dq_rad_s` per joint (`q_m`, `dq_m_s` of
/// one that slides), and `scene`, the scene as JSON on the first row of each episode (empty text on the others).
pub fn to_table(robot: &Robot, plans: &[Plan]) -> Table {
    let rows = || plans.iter().flat_map(|p| p.waypoints.iter().enumerate().map(move |(step, w)| (p, step, w)));
    let scene = |p: &Plan, step: usize| match step {
        0 => p.scene.to_json().to_string(),
        _ => String::new(),
    };
    let mut table = Table::default()
        .with("episode", "Episode number.", Values::I64(rows().map(|(p, ..)| p.index as i64).collect()))
        .with("step", "Control step within the episode, from 0.", Values::I64(rows().map(|(_, step, _)| step as i64).collect()))
        .with(
            "goal",
            "Goal of the task that the step is for, from 0.",
            Values::I64(rows().map(|(.., w)| w.goal as i64).collect()),
        )
        .with("phase", "Part of the plan.", Values::Text(rows().map(|(.., w)| w.phase.name().into()).collect()));
    for (j, joint) in robot.joints.iter().enumerate() {
        let position = Values::F64(rows().map(|(.., w)| w.q[j]).collect());
        table = table.with(&joint.position_name(), "Joint position.", position);
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        let velocity = Values::F64(rows().map(|(.., w)| w.dq[j]).collect());
        table = table.with(&joint.velocity_name(), "Joint velocity that leads to the next step.", velocity);
    }
    table.with(
        "scene",
        "The scene as JSON on the first row of each episode, empty on the others.",
        Values::Text(rows().map(|(p, step, _)| scene(p, step)).collect()),
    )
}

/// The inverse of [`to_table`], of plans of `robot` in `task`. Where no goals are said, all is for the first.
///
/// # Errors
/// Says which column is missing or of another type, and in which row a number is not finite, a phase unknown, a scene unreadable, or the
/// order of episodes, steps or phases broken.
pub fn from_table(robot: &Arc<Robot>, task: &Arc<Task>, table: &Table) -> Result<Vec<Plan>, String> {
    let mut rows = Rows::new(robot, task);
    let mut plans = rows.take(table)?;
    plans.extend(rows.open);
    Ok(plans)
}

/// The plans in a table that comes in pieces, as [`from_table`] has them: one after another, in the memory of a piece.
pub struct Plans<T> {
    path: PathBuf,
    tables: T,
    rows: Rows,
    ready: std::vec::IntoIter<Plan>,
}

impl<T> Plans<T> {
    /// Of the pieces of a table of plans of `robot` in `task`; errors speak of `path`.
    pub fn new(path: &Path, (robot, task): (&Arc<Robot>, &Arc<Task>), tables: T) -> Self {
        Plans { path: path.to_path_buf(), tables, rows: Rows::new(robot, task), ready: Vec::new().into_iter() }
    }
}

impl<T: Iterator<Item = crate::error::Result<Table>>> Iterator for Plans<T> {
    type Item = crate::error::Result<Plan>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(plan) = self.ready.next() {
                return Some(Ok(plan));
            }
            let Some(table) = self.tables.next() else { return self.rows.open.take().map(Ok) };
            match table.and_then(|table| self.rows.take(&table).map_err(|why| Error::input(&self.path, why))) {
                Ok(plans) => self.ready = plans.into_iter(),
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

/// What is known of the rows so far.
struct Rows {
    robot: Arc<Robot>,
    task: Arc<Task>,
    count: usize,
    begun: HashSet<u64>,
    /// The plan of the last row, which may go on.
    open: Option<Plan>,
}

impl Rows {
    fn new(robot: &Arc<Robot>, task: &Arc<Task>) -> Self {
        Rows { robot: Arc::clone(robot), task: Arc::clone(task), count: 0, begun: HashSet::new(), open: None }
    }

    /// The plans that are known to end: all but the one of the last row.
    fn take(&mut self, table: &Table) -> Result<Vec<Plan>, String> {
        let (episodes, steps) = (integers(table, "episode")?, integers(table, "step")?);
        let (phases, scenes) = (texts(table, "phase")?, texts(table, "scene")?);
        let goals = table.column("goal").map(|_| integers(table, "goal")).transpose()?;
        let (robot, task) = (Arc::clone(&self.robot), Arc::clone(&self.task));
        let columns = |name: fn(&Joint) -> String| {
            robot.joints.iter().map(|joint| floats(table, &name(joint))).collect::<Result<Vec<_>, _>>()
        };
        let (q, dq) = (columns(Joint::position_name)?, columns(Joint::velocity_name)?);
        if let Some(c) = table.columns.iter().find(|c| c.values.len() != episodes.len()) {
            return Err(format!("column {} has {} rows, episode has {}", c.name, c.values.len(), episodes.len()));
        }
        let mut ended = Vec::new();
        for row in 0..episodes.len() {
            let at = |what: String| format!("row {}: {what}", self.count);
            let phase = Phase::ALL.into_iter().find(|p| p.name() == phases[row]).ok_or_else(|| {
                at(format!("unknown phase \"{}\"; allowed: {}", phases[row], Phase::ALL.map(Phase::name).join(", ")))
            })?;
            let (q, dq) = (numbers(&robot, &q, row).map_err(at)?, numbers(&robot, &dq, row).map_err(at)?);
            let said = goals.map_or(0, |goals| goals[row]);
            let goal = usize::try_from(said).ok().filter(|goal| *goal < task.goals.len());
            let goal = goal.ok_or_else(|| at(format!("goal {said}; {task} has 0 to {}", task.goals.len() - 1)))?;
            let waypoint = Waypoint { goal, phase, q, dq };
            let index = u64::try_from(episodes[row]).map_err(|_| at(format!("episode {} is negative", episodes[row])))?;
            if steps[row] == 0 {
                if !self.begun.insert(index) {
                    return Err(at(format!("episode {index} begins a second time")));
                }
                let scene = scene(&robot, &task, &scenes[row]).map_err(at)?;
                ended.extend(self.open.replace(Plan { index, scene, waypoints: vec![waypoint] }));
            } else {
                go_on(self.open.as_mut(), index, steps[row], waypoint).map_err(at)?;
            }
            self.count += 1;
        }
        Ok(ended)
    }
}

/// The next step of a plan, which must be the one of the row before.
fn go_on(open: Option<&mut Plan>, index: u64, step: i64, waypoint: Waypoint) -> Result<(), String> {
    let plan = open.filter(|p| p.index == index && p.waypoints.len() as i64 == step);
    let plan = plan.ok_or_else(|| format!("episode {index} step {step} does not follow the row before"))?;
    let last = &plan.waypoints[plan.waypoints.len() - 1];
    if last.goal > waypoint.goal {
        return Err(format!("goal {} comes after a later one", waypoint.goal));
    }
    if last.goal == waypoint.goal && last.phase > waypoint.phase {
        return Err(format!("phase {} comes after a later one", waypoint.phase.name()));
    }
    if plan.waypoints.len() > MOST_STEPS as usize {
        return Err(format!("episode {index} has more than {MOST_STEPS} steps, the most that are executed"));
    }
    plan.waypoints.push(waypoint);
    Ok(())
}

fn scene(robot: &Arc<Robot>, task: &Arc<Task>, json: &str) -> Result<Scene, String> {
    let scene = Scene::from_json(robot, task, json).map_err(|e| format!("the scene cannot be read: {e}"))?;
    check_scene(&scene).map_err(|why| format!("the scene cannot be: {why}"))?;
    Ok(scene)
}

/// A row of as many columns as there are joints.
fn numbers(robot: &Robot, columns: &[&[f64]], row: usize) -> Result<Joints, String> {
    let values = Joints::from_fn(columns.len(), |j| columns[j][row]);
    let name = |j: usize| &robot.joints[j].name;
    match values.iter().position(|v| v.is_nan() || v.abs() > LARGEST_NUMBER) {
        Some(j) if values[j].is_finite() => Err(format!("{} is {:e}, no position or velocity of a joint", name(j), values[j])),
        Some(j) => Err(format!("{} is {}, not a finite number", name(j), values[j])),
        None => Ok(values),
    }
}

fn values<'a>(table: &'a Table, name: &str) -> Result<&'a Values, String> {
    Ok(&table.column(name).ok_or_else(|| format!("column {name} is missing: this is no table of plans"))?.values)
}

fn integers<'a>(table: &'a Table, name: &str) -> Result<&'a [i64], String> {
    match values(table, name)? {
        Values::I64(v) => Ok(v),
        _ => Err(format!("column {name} must hold 64-bit integers")),
    }
}

fn floats<'a>(table: &'a Table, name: &str) -> Result<&'a [f64], String> {
    match values(table, name)? {
        Values::F64(v) => Ok(v),
        _ => Err(format!("column {name} must hold 64-bit floats")),
    }
}

fn texts<'a>(table: &'a Table, name: &str) -> Result<&'a [String], String> {
    match values(table, name)? {
        Values::Text(v) => Ok(v),
        _ => Err(format!("column {name} must hold text")),
    }
}
