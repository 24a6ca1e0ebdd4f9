use super::places::{Content, Places};
use super::{Context, Outcome, output};
use crate::data::atomic;
use crate::error::{Error, Result};
use crate::report::curves::{
    LIVE, Plot, Style, columns, draw, draw_errors, errors_picture, holds_model_errors, is_pretraining, latest, live_of,
    model_errors, picture, plots, sources,
};
use std::fs;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, SystemTime};

/// Draw curves of training on the terminal or as SVG: d_conv and alpha, losses, validation, norms of gradients, the dynamics network's error; several runs
/// over each other.
///
/// Each stage of training is as wide as the next. --watch draws again whenever a training has written more (hilt train --live, make all LIVE=1) and ends
/// with it. A picture of a run is one of its trainings; of its dynamics network's errors that of dynamics.errors.parquet.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt plot policy.training.parquet --metric d_conv --metric alpha")]
pub struct Args {
    /// Runs, tables of metrics (policy.training.parquet, dynamics.pretraining.parquet), errors of a dynamics network (dynamics.errors.parquet), or what
    /// hilt train --live writes
    #[arg(value_name = "RUN|FILE", required = true)]
    of: Vec<PathBuf>,
    /// Draw this metric, a column of the table; may be repeated [default: those that say most]
    #[arg(long, value_name = "NAME")]
    metric: Vec<String>,
    /// Write a picture instead
    #[arg(long, value_name = "FILE.svg")]
    out: Option<PathBuf>,
    /// Draw again whenever there is more, until training ends or Ctrl-C
    #[arg(long, conflicts_with = "out")]
    watch: bool,
}

/// Characters of a line where stdout is no terminal.
const WIDTH: usize = 80;
/// Lines of a plot.
const HEIGHT: usize = 7;
/// Lines that a plot has beside those: title, axis, names of stages.
const AROUND: usize = 3;
/// Between two looks at a file that grows.
const TICK: Duration = Duration::from_millis(300);
/// To the upper left corner; clears to the end of a line, and below.
const HOME: &str = "\u{1b}[H";
const TO_END: &str = "\u{1b}[K\n";
const BELOW: &str = "\u{1b}[J";
const CLEAR: &str = "\u{1b}[2J";

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    // A picture may stand in the run that it is of.
    let read = args.of.iter().map(PathBuf::as_path).filter(|path| !path.is_dir());
    let places = args.out.iter().fold(Places::new().read_all(read), |places, out| places.write("--out", out, Content::Svg));
    places.check(&context.console)?;
    if args.watch {
        return watch(args, context);
    }
    let (errors, trainings): (Vec<PathBuf>, Vec<PathBuf>) = args.of.iter().cloned().partition(|path| holds_model_errors(path));
    if !errors.is_empty() && !args.metric.is_empty() {
        let message = format!("--metric chooses curves of trainings, and {} has none; leave one out", errors[0].display());
        return Err(Error::Usage(message));
    }
    let found = if trainings.is_empty() { Vec::new() } else { drawn(&trainings, args, context)? };
    let Some(out) = &args.out else {
        let asked = if args.metric.is_empty() { args.of.as_slice() } else { &[] };
        let (style, errors) = (style(None), model_errors(asked, &context.interrupt)?);
        output::print(&(draw(&found, &style) + &draw_errors(&errors, &style)))?;
        return Ok(Outcome::Done);
    };
    let made = match errors.as_slice() {
        [] => {
            let names: Vec<String> = args.of.iter().map(|path| path.display().to_string()).collect();
            picture("training", &format!("Training: {}", names.join(", ")), &found)
        }
        errors if trainings.is_empty() => errors_picture(&model_errors(errors, &context.interrupt)?),
        _ => return Err(Error::Usage("--out draws curves of trainings, or errors of dynamics networks: name one kind".into())),
    };
    atomic::write_bytes(out, made.to_svg().as_bytes())?;
    context.console.say(&format!("plot: wrote {}", out.display()));
    Ok(Outcome::Done)
}

fn drawn(of: &[PathBuf], args: &Args, context: &Context) -> Result<Vec<Plot>> {
    plots(&sources(of, &context.interrupt)?, &args.metric).map_err(Error::Usage)
}

/// As the terminal is; where it has so many `plots`, lower, so that all of them fit.
fn style(plots: Option<usize>) -> Style {
    let size = output::size();
    let width = size.map_or(WIDTH, |[width, _]| width);
    let mut style = Style { width, height: HEIGHT, colour: output::colour(), unicode: output::unicode() };
    if let (Some([_, lines]), Some(plots)) = (size, plots) {
        let rows = plots.div_ceil(columns(width, plots)).max(1);
        // One for the legend, one for the cursor.
        style.height = ((lines.saturating_sub(2)) / rows).saturating_sub(AROUND).clamp(2, HEIGHT);
    }
    style
}

fn watch(args: &Args, context: &Context) -> Result<Outcome> {
    let [of] = args.of.as_slice() else {
        return Err(Error::Usage("--watch follows one training: name one run, or one file of hilt train --live".into()));
    };
    if !of.is_dir() && !LIVE.iter().any(|end| of.as_os_str().as_encoded_bytes().ends_with(end.as_bytes())) {
        let (of, known) = (of.display(), LIVE.join(" nor in "));
        context
            .console
            .say(&format!("plot: {of} ends neither in {known}: the end of its training is not seen; Ctrl-C ends this"));
    }
    let (mut seen, mut waits) = (None, false);
    // In a run training follows, after a pretraining that is over.
    let mut ended: Option<PathBuf> = None;
    while !context.interrupt.is_raised() {
        let live = if of.is_dir() { live_of(of)?.into_iter().next() } else { Some(of.clone()) };
        match live.filter(|file| has_begun(file) && ended.as_ref() != Some(file)) {
            None if !waits && ended.is_none() => {
                let shown = of.display();
                let advice = match of.extension() {
                    Some(_) => format!("hilt train --live {shown}"),
                    None => format!("hilt train --live {shown}/policy.training.jsonl, or make all LIVE=1"),
                };
                context.console.say(&format!("plot: waits for a training that writes its metrics: {advice}"));
                waits = true;
            }
            None => {}
            Some(file) => {
                let now = stamp(&file);
                let over = is_over(&file);
                if now != seen || over {
                    show(&file, args, context, seen.is_none())?;
                    seen = now;
                }
                if over && of.is_dir() && is_pretraining(&file) {
                    context.console.say("plot: pretraining has ended; waits for the training");
                    (ended, seen) = (Some(file), None);
                } else if over {
                    context.console.say("plot: training has ended");
                    return Ok(Outcome::Done);
                }
            }
        }
        sleep(TICK);
    }
    Ok(Outcome::Done)
}

/// Whether something is written: a file begins empty.
fn has_begun(live: &Path) -> bool {
    fs::metadata(live).is_ok_and(|found| found.is_file() && found.len() > 0)
}

/// Time and size.
fn stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let found = fs::metadata(path).ok()?;
    Some((found.modified().ok()?, found.len()))
}

/// Whether the table that training ends with stands beside, and is newer.
fn is_over(live: &Path) -> bool {
    let table = stamp(&live.with_extension("parquet"));
    table.is_some_and(|(time, _)| stamp(live).is_some_and(|(last, _)| time >= last))
}

/// In place on a terminal that can, a line where stdout is none or a simple one.
fn show(file: &Path, args: &Args, context: &Context, first: bool) -> Result<()> {
    let found = sources(&[file.to_path_buf()], &context.interrupt)?;
    let can = output::size().is_some() && output::moves();
    if !can || found[0].metrics.rows() == 0 {
        return output::print(&format!("{}\n", latest(&found[0])));
    }
    let mut plots = plots(&found, &args.metric).map_err(Error::Usage)?;
    let fits = output::size().map_or(plots.len(), |[width, lines]| {
        let rows = (lines.saturating_sub(2) / (AROUND + 2)).max(1);
        rows * columns(width, plots.len())
    });
    plots.truncate(fits);
    let text = draw(&plots, &style(Some(plots.len())));
    let begin = if first { format!("{CLEAR}{HOME}") } else { HOME.into() };
    output::print(&format!("{begin}{}{BELOW}", text.replace('\n', TO_END)))
}
