use super::common::task_said;
use super::places::{Content, Places};
use super::trial::{Trial, trial};
use super::{Context, Outcome, output};
use crate::data::atomic;
use crate::error::{Error, Result};
use crate::report::render::robot_png;
use crate::report::table::text_table;
use crate::robot::Robot;
use crate::robot::check::{Findings, check};
use crate::robot::file::description::Read;
use crate::robot::file::{self, built_in};
use crate::robot::model::JointKind;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

/// Size of a picture of a robot \[pixels\].
const PICTURE_PX: (u32, u32) = (480, 360);

/// Look at a robot before it is used.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    Check(CheckArgs),
    Draft(DraftArgs),
}

/// Say what is missing or doubtful: limits, inertia, motors, self-collision in the ready pose, strength, fingers; a map of where the hand
/// gets to; and what comes of it when the demonstrator tries a task.
///
/// A robot is two files: a URDF, and a TOML beside it that says what a URDF cannot; those of pipelines/robots are examples.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt robot check ur5e --png ur5e.png")]
struct CheckArgs {
    /// A robot's TOML file, or the name of one that comes with hilt: jaco, panda, ur5e
    #[arg(value_name = "FILE.toml|NAME")]
    robot: PathBuf,
    /// Draw it in its ready pose, with the hand open and closed
    #[arg(long, value_name = "FILE.png")]
    png: Option<PathBuf>,
    /// What the demonstrator tries with it: a task that comes with hilt, or the TOML file of another
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "pick-up")]
    task: String,
    /// How often it tries, as `hilt plan --seed 0` and `hilt simulate --seed 0 --set simulate.pulses.probability=0` would; 0: not at all
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(..=1000))]
    episodes: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Print the TOML of a robot as far as its URDF tells: arm and fingers, the tool between them, a ready pose, the reach, and what to begin with for
/// the motors.
///
/// Save it beside the URDF, look at it with `hilt robot check`, and correct it by hand.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt robot draft pipelines/robots/ur5e.urdf > drafted.toml")]
struct DraftArgs {
    /// The robot's URDF; expand xacro first
    #[arg(value_name = "FILE.urdf")]
    urdf: PathBuf,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    match &args.action {
        Action::Check(args) => run_check(args, context),
        Action::Draft(args) => {
            Places::new().read(&args.urdf).check(&context.console)?;
            output::print(&file::draft(&args.urdf, &context.interrupt)?)?;
            Ok(Outcome::Done)
        }
    }
}

fn run_check(args: &CheckArgs, context: &Context) -> Result<Outcome> {
    let is_file = args.robot.extension().is_some();
    let mut places = Places::new();
    if is_file {
        places = places.read(&args.robot);
    }
    if let Some(out) = &args.png {
        places = places.write("--png", out, Content::Png);
    }
    places.check(&context.console)?;
    let Read { robot, remarks } = if is_file {
        file::read(&args.robot)?
    } else {
        Read { robot: built_in::find(&args.robot.display().to_string())?, remarks: Vec::new() }
    };
    let robot = Arc::new(robot);
    let mut findings = check(&robot, &context.interrupt)?;
    let trial = attempt(args, context, &mut findings.doubts)?;
    if let Some(out) = &args.png {
        let mut bytes = Vec::new();
        robot_png(&robot, PICTURE_PX, &mut bytes)?;
        atomic::write_bytes(out, &bytes)?;
        context.console.say(&format!("robot: wrote {}", out.display()));
    }
    if args.json {
        output::print_json(&json!({ "robot": robot.name, "remarks": remarks, "findings": findings, "trial": trial }))?;
    } else {
        output::print(&words(&robot, &remarks, &findings, trial.as_ref()))?;
    }
    Ok(Outcome::Done)
}

/// What comes of it when the demonstrator tries; what keeps it from trying is a doubt.
fn attempt(args: &CheckArgs, context: &Context, doubts: &mut Vec<String>) -> Result<Option<Trial>> {
    let task = task_said(&args.task)?;
    if args.episodes == 0 {
        return Ok(None);
    }
    let name = task.name.clone();
    match trial(&args.robot.display().to_string(), task, args.episodes, context) {
        Ok(trial) => {
            doubts.extend(trial.doubt());
            Ok(Some(trial))
        }
        Err(why @ (Error::Usage(_) | Error::Failed(_))) => {
            doubts.push(format!("{name} cannot be tried: {why}"));
            Ok(None)
        }
        Err(why) => Err(why),
    }
}

fn words(robot: &Robot, remarks: &[String], findings: &Findings, trial: Option<&Trial>) -> String {
    let mut text = format!("{}: an arm of {} joints, {} fingers\n", robot.name, robot.arm, robot.fingers().len());
    for (title, lines) in [("doubtful", &findings.doubts[..]), ("read as", remarks)] {
        if !lines.is_empty() {
            text += &format!("\n{title}:\n");
            lines.iter().for_each(|line| text += &format!("  {line}\n"));
        }
    }
    if findings.doubts.is_empty() {
        text += "\nnothing doubtful\n";
    }
    let rows: Vec<Vec<String>> = robot
        .joints
        .iter()
        .zip(&robot.links[1..])
        .zip(&robot.ready)
        .map(|((joint, link), ready)| {
            let unit = if joint.kind == JointKind::Revolute { "rad" } else { "m" };
            let limit = |k: usize| if joint.continuous { "free".into() } else { format!("{:.3}", joint.limits[k]) };
            let numbers = [joint.velocity, joint.effort, link.inertia.mass_kg].map(|v| format!("{v:.3}"));
            let own = vec![joint.name.clone(), unit.into(), limit(0), limit(1), format!("{ready:.3}")];
            own.into_iter().chain(numbers).collect()
        })
        .collect();
    text += &format!("\n{}", text_table(&["joint", "unit", "low", "high", "ready", "speed/s", "effort", "moves kg"], &rows));
    let [x, y, z] = findings.ready_tool_m;
    text += &format!("\ntool in the ready pose: x {x:.3}, y {y:.3}, z {z:.3} m\n");
    if let (Some([one, other]), Some(room)) = (&findings.opposing, findings.opening_m) {
        text += &format!("opposing fingers: {one} and {other}, {room:.3} m between the middles of their pads in the open hand\n");
    }
    if let Some(trial) = trial {
        text += &format!("{}\n", trial.words());
    }
    let reach = &findings.reach;
    text += &format!(
        "\nwhere the hand gets to, straight down, {} m over the table (# well, + badly, . not; ahead is up):\n",
        reach.height_m
    );
    text + &reach.map()
}
