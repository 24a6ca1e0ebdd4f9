//! The paper's Figure 7: success over epochs, environment steps and time, a curve a method. Each point is trainings of one length, run to their
//! end and evaluated, so a curve is not one training watched on its way.

use super::curves::numbers;
use super::finished::{Arm, Finished, Measured, look};
use super::words::{minutes, percent_within};
use crate::data::dataset::{self, TRAIN, VALIDATION};
use crate::error::Result;
use crate::learn::MethodName;
use crate::report::chart::{Axis, Chart, Panel, Point, Series};
use crate::report::page::{Block, Cell, Column, Table};
use crate::report::statistics::{Estimate, average};

/// Column of the metrics of a method that acts in the simulator: control steps so far.
const ENV_STEPS: &str = "env_steps";

/// What time is measured by: the processor's, unless a log of an older version has wall time alone.
#[derive(Clone, Copy)]
enum Clock {
    Processor,
    Wall,
}

impl Clock {
    fn of(finished: &Finished) -> Self {
        if finished.runs.iter().all(|m| m.train_processor_s.is_some()) { Clock::Processor } else { Clock::Wall }
    }

    fn name(self) -> &'static str {
        ["processor time", "wall time"][self as usize]
    }

    fn read(self) -> fn(&Measured) -> Option<f64> {
        match self {
            Clock::Processor => |m| m.train_processor_s,
            Clock::Wall => |m| m.train_s,
        }
    }
}

/// A length of training of one curve.
struct Length<'a> {
    arm: Arm<'a>,
    task: &'a str,
    curve: Curve<'a>,
    epochs: f64,
    env_steps: f64,
    train_s: Option<f64>,
    success: Estimate,
    singles: Vec<f64>,
}

/// The trainings that differ in nothing but their length: those of a method whose variations are called alike, but for the number at the end.
#[derive(Clone, Copy, PartialEq)]
struct Curve<'a> {
    method: MethodName,
    family: &'a str,
}

impl<'a> Curve<'a> {
    fn of(arm: Arm<'a>) -> Self {
        let family = arm.variation.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('-');
        Curve { method: arm.method, family }
    }

    /// All of them, those of one method together.
    fn all(finished: &'a Finished) -> Vec<Self> {
        let arms = finished.arms();
        let of_method = |method: &MethodName| {
            let method = *method;
            arms.iter().filter(move |arm| arm.method == method).map(|arm| Curve::of(*arm)).collect::<Vec<_>>()
        };
        let mut curves: Vec<Self> = finished.experiment.methods.iter().flat_map(of_method).collect();
        let mut seen: Vec<Self> = Vec::new();
        curves.retain(|curve| {
            let new = !seen.contains(curve);
            seen.push(*curve);
            new
        });
        curves
    }

    /// The method's name; of a second curve with what its variations are called.
    fn name(self, all: &[Self]) -> String {
        let first = all.iter().find(|curve| curve.method == self.method);
        let method = self.method.name();
        if first.is_none_or(|first| *first == self) { method.into() } else { format!("{method}, {}", self.family) }
    }
}

/// Figures and the table of plateaus.
///
/// # Errors
/// What reading the descriptions of datasets returns.
pub fn blocks(finished: &Finished) -> Result<Vec<Block>> {
    let lengths = lengths(finished)?;
    let figure = |name: &str, title: &str, label: &str, axis: Axis, x: &dyn Fn(&Length) -> Option<f64>, caption: &str| {
        let chart = chart(finished, &lengths, (name, title, label, axis), x);
        Block::Figure(chart.draw(), format!("{caption} {}", super::common::intervals(finished)))
    };
    // An epoch of a method that acts is an iteration, and imitation takes no steps: what says nothing is not drawn.
    let acts = finished.runs.iter().any(|m| numbers(&m.metrics, ENV_STEPS).is_some());
    let imitates = finished.runs.iter().any(|m| numbers(&m.metrics, ENV_STEPS).is_none());
    let mut blocks = Vec::new();
    if imitates {
        blocks.push(figure(
            "epochs",
            "Success over training epochs",
            "epochs, warm start included (log)",
            Axis::Log,
            &|l| Some(l.epochs),
            "Success over the number of epochs: the paper's Figure 7. Each point is trainings of that length, run to their end.",
        ));
    }
    if acts {
        let caption = "Success over all control steps that were executed for it: those of the demos, and those that a method takes itself. Each point is \
             trainings of that length, run to their end.";
        let above = if imitates {
            " Imitation takes none of its own, so all its lengths of training stand above each other."
        } else {
            ""
        };
        blocks.push(figure(
            "env-steps",
            "Success over steps in the environment",
            "control steps, demos included (log)",
            Axis::Log,
            &|l| Some(l.env_steps),
            &format!("{caption}{above}"),
        ));
    }
    let clock = Clock::of(finished);
    if lengths.iter().all(|l| l.train_s.is_some()) {
        let caption = format!("Success over the {} of `hilt train`, mean over seeds, on the machine of the runs.", clock.name());
        let title = format!("Success over {} of training", clock.name());
        blocks.push(figure("time", &title, "minutes of training (log)", Axis::Log, &|l| l.train_s.map(|s| s / 60.0), &caption));
    } else {
        blocks.push(Block::Words("Logs of trainings are missing, so there is no figure over time.".into()));
    }
    blocks.push(Block::Table(plateaus(finished, &lengths, clock)));
    Ok(blocks)
}

/// Every arm and task, by method, task and length.
fn lengths(finished: &Finished) -> Result<Vec<Length<'_>>> {
    let (mut all, clock) = (Vec::new(), Clock::of(finished).read());
    for arm in finished.arms() {
        for task in finished.tasks() {
            let runs: Vec<&Measured> = finished.of(arm, task).collect();
            let Some(success) = finished.success(arm, task) else { continue };
            let steps = runs.iter().map(|m| env_steps(finished, m)).collect::<Result<Vec<f64>>>()?;
            let epochs: Vec<f64> = runs.iter().map(|m| m.metrics.rows() as f64).collect();
            let singles = finished.singles(arm, task);
            let (epochs, env_steps, train_s) = (average(&epochs), average(&steps), finished.train_s(arm, task, clock));
            all.push(Length { arm, task, curve: Curve::of(arm), epochs, env_steps, train_s, success, singles });
        }
    }
    all.sort_by(|a, b| a.epochs.total_cmp(&b.epochs));
    Ok(all)
}

/// Control steps of the demos of a run and of its own acting.
fn env_steps(finished: &Finished, measured: &Measured) -> Result<f64> {
    let own = numbers(&measured.metrics, ENV_STEPS).and_then(|column| column.last().copied()).unwrap_or(0.0);
    let inputs = &finished.grid.steps[measured.run.train].inputs;
    let mut steps = own;
    for input in inputs.iter().filter(|input| input.role == "dataset") {
        for part in [TRAIN, VALIDATION] {
            steps += dataset::frames(&input.path.join(part))? as f64;
        }
    }
    Ok(steps)
}

fn chart(finished: &Finished, lengths: &[Length], about: (&str, &str, &str, Axis), x: &dyn Fn(&Length) -> Option<f64>) -> Chart {
    let (name, title, x_label, axis) = about;
    let experiment = &finished.experiment;
    let (mut panels, curves) = (Vec::new(), Curve::all(finished));
    for preset in &experiment.presets {
        for task in finished.tasks() {
            let series = curves.iter().map(|curve| {
                let of = lengths.iter().filter(|l| (l.arm.preset, l.curve, l.task) == (preset, *curve, task));
                let point = |l: &Length| {
                    Some(Point { x: x(l)?, value: l.success.value, interval: l.success.interval, singles: l.singles.clone() })
                };
                Series {
                    name: curve.name(&curves),
                    look: look(curve.method),
                    points: of.filter_map(point).collect(),
                    dense: false,
                }
            });
            let series: Vec<Series> = series.filter(|series| !series.points.is_empty()).collect();
            let title = if experiment.presets.len() > 1 { format!("{task} ({preset})") } else { task.to_string() };
            if !series.is_empty() {
                panels.push(Panel { title, series });
            }
        }
    }
    Chart {
        id: format!("{}-{name}", experiment.name),
        title: title.into(),
        description: format!("{title}, a curve for each method and a panel for each task"),
        x_label: x_label.into(),
        y_label: "success".into(),
        note: "markers: mean over seeds, with 95 % intervals; dots: single seeds".into(),
        x: axis,
        percent: true,
        panels,
    }
}

/// The longest training of each method and preset, of its first curve: what methods are compared at.
pub fn longest(finished: &Finished) -> Vec<Arm<'_>> {
    let rows = |arm: Arm| finished.runs.iter().filter(|m| Arm::of(&m.run) == arm).map(|m| m.metrics.rows()).max().unwrap_or(0);
    let curves = Curve::all(finished);
    let first = |arm: &Arm| curves.iter().find(|curve| curve.method == arm.method) == Some(&Curve::of(*arm));
    finished.arms().into_iter().filter(first).fold(Vec::new(), |mut longest: Vec<Arm>, arm| {
        match longest.iter_mut().find(|known| (known.preset, known.method) == (arm.preset, arm.method)) {
            Some(known) if rows(*known) < rows(arm) => *known = arm,
            Some(_) => {}
            None => longest.push(arm),
        }
        longest
    })
}

/// The shortest of lengths in order, from which on every mean lies within or above the interval of the longest; `None` where that reaches down to 0.
fn plateau(successes: &[Estimate]) -> Option<usize> {
    let enough = successes.last().map(|last| last.interval[0]).filter(|low| *low > 0.0)?;
    let below = successes.iter().rposition(|success| success.value < enough);
    Some(below.map_or(0, |at| at + 1).min(successes.len() - 1))
}

fn plateaus(finished: &Finished, lengths: &[Length], clock: Clock) -> Table {
    let experiment = &finished.experiment;
    let (mut rows, curves) = (Vec::new(), Curve::all(finished));
    for preset in &experiment.presets {
        for task in finished.tasks() {
            for curve in &curves {
                let of = lengths.iter().filter(|l| (l.arm.preset, l.curve, l.task) == (preset, *curve, task));
                let of: Vec<&Length> = of.collect();
                let successes: Vec<Estimate> = of.iter().map(|l| l.success).collect();
                if let Some(last) = of.last() {
                    let name = curve.name(&curves);
                    let name = if experiment.presets.len() > 1 { format!("{name} ({preset})") } else { name };
                    let cells_of =
                        |l: &Length| [format!("{:.0}", l.epochs).into(), minutes(l.train_s), percent_within(l.success).into()];
                    let mut cells = vec![Cell::from(name), task.into()];
                    cells.extend(plateau(&successes).map_or(["–", "–", "–"].map(Cell::from), |at| cells_of(of[at])));
                    cells.extend(cells_of(last));
                    rows.push(cells);
                }
            }
        }
    }
    let of = |group: &str, name: &str| Column::of(group, name);
    let columns = vec![
        Column::words(""),
        Column::words("task"),
        of("at the plateau", "epochs"),
        of("at the plateau", "minutes"),
        of("at the plateau", "success, %"),
        of("longest training", "epochs"),
        of("longest training", "minutes"),
        of("longest training", "success, %"),
    ];
    let caption = format!(
        "Time to plateau: the shortest training from which on mean success never again lies below the interval of the longest training; a dash \
         where that interval reaches down to 0. Where it is the longest training itself, success may still be rising; where \
         it is the first, success may have fallen since. Minutes: {}.",
        clock.name()
    );
    Table { caption, columns, rows }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: dense rewards were a fourth length of the staged ones.
    #[test]
    fn variations_that_are_called_otherwise_are_another_curve() {
        let of = |variation| Curve::of(Arm { preset: "paper", variation, method: MethodName::Ppo });
        assert!(of("steps-100000") == of("steps-400000") && of("steps-400000") != of("dense-400000"));
        let all = [of("steps-100000"), of("dense-400000")];
        assert_eq!(all.map(|curve| curve.name(&all)), ["ppo", "ppo, dense"]);
    }

    #[test]
    fn the_plateau_begins_where_success_stays_within_the_interval_of_the_last() {
        let of =
            |values: &[f64]| values.iter().map(|v| Estimate { value: *v, interval: [v - 0.05, v + 0.05] }).collect::<Vec<_>>();
        assert_eq!(plateau(&of(&[0.1, 0.87, 0.5, 0.86, 0.9])), Some(3));
        assert_eq!(plateau(&of(&[0.95, 0.9])), Some(0));
        assert_eq!(plateau(&of(&[0.1, 0.9])), Some(1));
        assert_eq!((plateau(&[]), plateau(&of(&[0.0, 0.04]))), (None, None));
    }
}
