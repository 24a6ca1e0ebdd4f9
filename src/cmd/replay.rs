use super::fits::of_recording;
use super::page::who;
use super::places::{Content, Places};
use super::subject::{Chosen, ServedArgs, Subject};
use super::{Context, Outcome, output, train};
use crate::config::Pipeline;
use crate::data::{Provenance, atomic, recording};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::eval::{Moment, Replay, Rollouts};
use crate::sim::Controller;
use crate::state::CONTROL_DT_S;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Run a recorded episode on from one of its moments, with another policy, the planner, or other noise.
///
/// The recording's commands are executed again up to the moment: joints, objects, their velocities and the forces between them are what they were, to
/// the bit; what is not is said. With the policy and the seed of the recording the rest is the recording's, too. A sampled action, a policy that is
/// served and the planner begin anew at the moment. The planner begins with an open hand: not while the fingers hold something.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt replay --from rollouts/episode-00000.mcap --at 1.5 --policy policy-bc.safetensors")]
pub struct Args {
    /// Recording to begin from
    #[arg(long, value_name = "FILE.mcap")]
    from: PathBuf,
    /// Moment, in seconds from its start (a step takes 0.05)
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    at: f64,
    /// Who goes on: weights of a policy, "planner", or the address of a policy that somebody serves
    #[arg(long, value_name = "planner|FILE|ws://HOST:PORT")]
    policy: PathBuf,
    #[command(flatten)]
    served: ServedArgs,
    /// Seed of the noise from the moment on [default: the recording's]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Variance of the noise on every command from the moment on \[(rad/s)^2\] [default: the recording's]
    #[arg(long, value_name = "VARIANCE", allow_negative_numbers = true)]
    noise: Option<f64>,
    /// Control steps before the episode is given up, those before the moment too [default: the recording's, or the policy's]
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..=20_000))]
    horizon: Option<u32>,
    /// Recording to write [default: in the working directory, the recording's name with -replay]
    #[arg(long, value_name = "FILE.mcap")]
    out: Option<PathBuf>,
    /// Print the result as JSON instead of words
    #[arg(long)]
    json: bool,
}

/// The stage in the provenance of what is written, and the key of what it was made from.
const STAGE: &str = "replay";
/// Largest noise that settings allow, too \[(rad/s)^2\].
const MOST_NOISE: f64 = 1.0;
/// A moment further from what was recorded than this is another one \[rad, m\].
const MOST_APART: f64 = 1e-3;

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let stem = args.from.file_stem().unwrap_or_default().display();
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{stem}-replay.mcap")));
    let places = Places::new().read(&args.from).read_all(Chosen::file(&args.policy)).read_all(args.served.reads());
    places.write("--out", &out, Content::Recording(STAGE)).check(&context.console)?;
    let (recorded, made, content) = recording::read_hashed(&args.from)?;
    let at = moment(args.at, &recorded)?;
    let pipeline = pipeline(&args.from, &recorded, &made, args.noise)?;
    if let Some(file) = Chosen::file(&args.policy) {
        of_recording(file, train::KIND, &recorded.scene)?;
    }
    let Chosen { subject, content: policy, said, .. } = Chosen::read(&args.policy, &args.served, &pipeline, &context.interrupt)?;
    let (stream, pulses) = noise(&made, &pipeline);
    let horizon_steps = args.horizon.unwrap_or_else(|| subject.horizon_steps(&pipeline));
    if horizon_steps as usize <= at {
        let message = format!("--horizon {horizon_steps}: the moment is before step {at}; give more steps, or an earlier moment");
        return Err(Error::Usage(message));
    }
    let replay = Replay { pipeline: &pipeline, seed: args.seed.unwrap_or(made.seed), stream: &stream, pulses, horizon_steps };
    let from = Moment { recorded: &recorded, at };
    let mut controller = controller(from, &subject, &replay, context)?;
    let (episode, apart) = replay.run(from, controller.as_mut(), &context.interrupt)?;
    subject.check()?;
    if apart > MOST_APART {
        let message = format!(
            "its commands lead {apart:.3} (rad, m) away from what it holds: another version of the physics recorded it ({}); record it anew",
            made.hilt_version
        );
        return Err(Error::input(&args.from, message));
    }

    let mut provenance =
        Provenance::new(STAGE, &recorded.scene.task.name, made.settings.clone(), replay.seed).with_input("recording", &content);
    provenance = policy.iter().fold(provenance, |made, policy| made.with_input("policy", policy));
    provenance.settings["simulate"]["noise_variance"] = pipeline.simulate.noise_variance.into();
    provenance.settings["policy"] = said;
    provenance.settings[STAGE] = json!({ "step": at, "noise": stream, "pulses": pulses, "of": made.stage });
    atomic::write_bytes(&out, &recording::encode(&out, &episode, &provenance)?)?;
    let told = Told { at, apart, recorded: &recorded, who: who(&made), episode: &episode, out: &out };
    if args.json {
        output::print_json(&told.json())?
    } else {
        output::print(&told.words())?
    }
    Ok(Outcome::Done)
}

/// The step that begins at a time.
fn moment(at_s: f64, recorded: &Episode) -> Result<usize> {
    let (steps, step) = (recorded.steps.len(), (at_s / CONTROL_DT_S).round());
    if (0.0..steps as f64).contains(&step) {
        return Ok(step as usize);
    }
    let last_s = steps.saturating_sub(1) as f64 * CONTROL_DT_S;
    Err(Error::Usage(format!("--at {at_s}: the episode has {steps} steps; allowed: 0 to {last_s:.2} seconds")))
}

/// The settings that the recording was made with, as far as it says them; the rest at their defaults.
fn pipeline(path: &Path, recorded: &Episode, made: &Provenance, noise: Option<f64>) -> Result<Pipeline> {
    fn section<T: DeserializeOwned + Default>(path: &Path, made: &Provenance, name: &str) -> Result<T> {
        match made.settings.get(name) {
            None | Some(Value::Null) => Ok(T::default()),
            Some(said) => serde_json::from_value(said.clone())
                .map_err(|e| Error::input(path, format!("its settings [{name}] cannot be read: {e}"))),
        }
    }
    let mut pipeline = Pipeline::defaults(&recorded.scene.task);
    pipeline.robot = recorded.scene.robot.clone().into();
    pipeline.plan = section(path, made, "plan")?;
    pipeline.simulate = section(path, made, "simulate")?;
    pipeline.evaluate = section(path, made, "evaluate")?;
    if let Some(noise) = noise {
        if !(0.0..=MOST_NOISE).contains(&noise) {
            return Err(Error::Usage(format!("--noise {noise}: a variance must be 0 to {MOST_NOISE}")));
        }
        pipeline.simulate.noise_variance = noise;
    }
    Ok(pipeline)
}

/// The random stream of the recording's noise, and whether it had pulses.
fn noise(made: &Provenance, pipeline: &Pipeline) -> (String, bool) {
    let before = &made.settings[STAGE];
    match (made.stage.as_str(), before["noise"].as_str(), before["pulses"].as_bool()) {
        (STAGE, Some(stream), Some(pulses)) => (stream.into(), pulses),
        ("simulate", ..) => ("simulate.noise".into(), true),
        _ => ("evaluate.noise".into(), pipeline.evaluate.pulses),
    }
}

/// Who acts from the moment on.
fn controller(from: Moment, subject: &Subject, replay: &Replay, context: &Context) -> Result<Box<dyn Controller>> {
    let Moment { recorded, at } = from;
    let (mut pipeline, scene) = (replay.pipeline.clone(), from.scene());
    let plans = matches!(subject, Subject::Planner);
    if plans && at > 0 {
        let held = from.held();
        if !held.is_empty() {
            let held = held.join(" and ");
            let message = format!(
                "--at: the fingers are on {held} then, and the planner begins with an open hand; choose a moment without, or a policy"
            );
            return Err(Error::Usage(message));
        }
        pipeline.robot = scene.robot.clone().into();
    }
    let rollouts = Rollouts::evaluation(&pipeline, replay.seed, replay.horizon_steps);
    let found = subject.controller(&rollouts, recorded.index, &scene, &context.interrupt)?;
    context.interrupt.check()?;
    found.ok_or_else(|| Error::Failed(format!("the planner finds no way from step {at}; choose another moment, or a policy")))
}

/// What is said in the end.
struct Told<'a> {
    at: usize,
    apart: f64,
    recorded: &'a Episode,
    who: String,
    episode: &'a Episode,
    out: &'a Path,
}

impl Told<'_> {
    fn json(&self) -> Value {
        let of = |episode: &Episode| json!({ "success": episode.success, "failure": episode.failure.map(|class| class.name()), "steps": episode.steps.len() });
        json!({
            "episode": self.recorded.index,
            "step": self.at,
            "restored_apart": self.apart,
            "recorded": of(self.recorded),
            "replay": of(self.episode),
            "same": self.same(),
            "out": self.out.display().to_string(),
        })
    }

    /// Whether all that was recorded came again.
    fn same(&self) -> bool {
        self.recorded == self.episode
    }

    fn words(&self) -> String {
        let of = |episode: &Episode| {
            let end = if episode.success { "success" } else { episode.failure.map_or("failed", |class| class.name()) };
            format!("{end} after {} steps", episode.steps.len())
        };
        let exactly = if self.apart == 0.0 { "exactly".into() } else { format!("to within {:.1e} (rad, m)", self.apart) };
        let same = if self.same() { ", the same to the last number" } else { "" };
        format!(
            "episode {} from step {} ({:.2} s), which was restored {exactly}: {}{same}\nrecorded, {}: {}\n{}\n",
            self.recorded.index,
            self.at,
            self.at as f64 * CONTROL_DT_S,
            of(self.episode),
            self.who,
            of(self.recorded),
            self.out.display()
        )
    }
}
