use super::page::{self, PageArgs};
use super::{Context, Outcome, output};
use crate::error::Result;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Look at recorded episodes in the browser: one page, with all it needs inside, to turn, play and compare them.
///
/// Opens the page if there is a browser, else prints where it is. Several recordings, or several directories with the same --episodes, are shown side by side or
/// in one picture: the same start for two methods and the planner.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  hilt view rollouts/episode-00000.mcap --no-open\n  hilt view rollouts recordings --episodes 0,1 --out both.html --no-open"
)]
pub struct Args {
    /// Recordings, directories of them, or runs, whose recordings are taken
    #[arg(value_name = "FILE.mcap|DIR|RUN", required = true)]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    page: PageArgs,
    /// Page to write [default: in the working directory, the first input's name with .html]
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
    /// Only write the page
    #[arg(long)]
    no_open: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let out = page::write(&args.inputs, &args.page, args.out.as_deref(), context)?;
    if args.no_open || !opened(&out) {
        output::print(&format!("{}\n", out.display()))?;
    } else {
        context.console.say(&format!("view: opened {}", out.display()));
    }
    Ok(Outcome::Done)
}

/// Whether a browser of this desktop took the page.
fn opened(page: &Path) -> bool {
    let opener = if cfg!(target_os = "macos") {
        "open"
    } else if ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty())) {
        "xdg-open"
    } else {
        return false;
    };
    let quiet = Command::new(opener).arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    quiet.is_ok_and(|status| status.success())
}
