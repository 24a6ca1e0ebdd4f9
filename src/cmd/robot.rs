use super::places::{Content, Places};
use super::{Context, Outcome, output};
use crate::data::atomic;
use crate::error::Result;
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
}

/// Say what is missing or doubtful: limits, inertia, self-collision in the ready pose, strength, fingers, and a map of where the hand
/// gets to.
///
/// A robot is two files: a URDF, and a TOML beside it that says what a URDF cannot; those of pipelines/robots are examples.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt robot check ur5e --png ur5e.png")]
struct CheckArgs {
    /// A robot's TOML file, or the name of one that comes with hilt: jaco, panda
    #[arg(value_name = "FILE.toml|NAME")]
    robot: PathBuf,
    /// Draw it in its ready pose, with the hand open and closed
    #[arg(long, value_name = "FILE.png")]
    png: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let Action::Check(args) = &args.action;
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
    let findings = check(&robot, &context.interrupt)?;
    if let Some(out) = &args.png {
        let mut bytes = Vec::new();
        robot_png(&robot, PICTURE_PX, &mut bytes)?;
        atomic::write_bytes(out, &bytes)?;
        context.console.say(&format!("robot: wrote {}", out.display()));
    }
    if args.json {
        output::print_json(&json!({ "robot": robot.name, "remarks": remarks, "findings": findings }))?;
    } else {
        output::print(&words(&robot, &remarks, &findings))?;
    }
    Ok(Outcome::Done)
}

fn words(robot: &Robot, remarks: &[String], findings: &Findings) -> String {
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
    let reach = &findings.reach;
    text += &format!(
        "\nwhere the hand gets to, straight down, {} m over the table (# well, + badly, . not; ahead is up):\n",
        reach.height_m
    );
    text + &reach.map()
}
