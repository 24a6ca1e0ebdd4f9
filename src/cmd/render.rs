use super::page::{self, PageArgs};
use super::places::{Content, Places};
use super::{Context, Outcome};
use crate::data::{atomic, recording as file};
use crate::error::{Error, Result};
use crate::report::render::{GifOptions, write_gif, write_png_sheet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Draw a recorded episode: an animated GIF, or a contact sheet as PNG; or episodes as a page to turn and play.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  hilt render rollouts/episode-00000.mcap --out episode.gif\n  hilt render rollouts/episode-00000.mcap --png --columns 5 --rows 2\n  hilt render rollouts/episode-00000.mcap --out page.html"
)]
pub struct Args {
    /// Recording; for a page several, directories of them or runs
    #[arg(value_name = "FILE.mcap", required = true)]
    recordings: Vec<PathBuf>,
    #[command(flatten)]
    format: Format,
    #[command(flatten)]
    page: PageArgs,
    /// Width of a picture in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 480)]
    width: u32,
    /// Height of a picture in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 360)]
    height: u32,
    /// Animation: control steps per picture
    #[arg(long, value_name = "N", default_value_t = 2)]
    every: u32,
    /// Animation: pictures per second
    #[arg(long, value_name = "N", default_value_t = 10)]
    fps: u32,
    /// Contact sheet: pictures side by side
    #[arg(long, value_name = "N", default_value_t = 4)]
    columns: u32,
    /// Contact sheet: rows of pictures
    #[arg(long, value_name = "N", default_value_t = 3)]
    rows: u32,
    /// File to write [default: in the working directory, the recording's name with .gif, .png or .html]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[group(multiple = false)]
struct Format {
    /// Write an animation [default: what the ending of --out says]
    #[arg(long)]
    gif: bool,
    /// Write a contact sheet [default: what the ending of --out says]
    #[arg(long)]
    png: bool,
    /// Write a page, as hilt view does [default: what the ending of --out says]
    #[arg(long)]
    html: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let picture = args.picture()?;
    if picture == Picture::Page {
        let out = page::write(&args.recordings, &args.page, args.out.as_deref(), context)?;
        context.console.say(&format!("render: wrote {}", out.display()));
        return Ok(Outcome::Done);
    }
    if args.page.given() {
        return Err(Error::Usage("--episodes, --atlas and --dynamics are for a page: give --html".into()));
    }
    let [recording] = args.recordings.as_slice() else {
        return Err(Error::Usage(format!(
            "{} recordings: a picture shows one; several go on a page with --html",
            args.recordings.len()
        )));
    };
    let (ending, content) = if picture == Picture::Gif { ("gif", Content::Gif) } else { ("png", Content::Png) };
    // Not beside the recording: a directory of recordings is an artefact of its own.
    let name = || Path::new(recording.file_name().unwrap_or_default()).with_extension(ending);
    let out = args.out.clone().unwrap_or_else(name);
    Places::new().read(recording).write("--out", &out, content).check(&context.console)?;
    let (episode, _) = file::read(recording)?;
    let size = (args.width, args.height);
    let mut bytes = Vec::new();
    if picture == Picture::Gif {
        let options = GifOptions { width: args.width, height: args.height, every_n_steps: args.every, fps: args.fps };
        write_gif(&episode, &options, &context.interrupt, &mut bytes)?;
    } else {
        write_png_sheet(&episode, (args.columns, args.rows), size, &context.interrupt, &mut bytes)?;
    }
    atomic::write_bytes(&out, &bytes)?;
    context.console.say(&format!("render: wrote {}", out.display()));
    Ok(Outcome::Done)
}

/// What is made.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Picture {
    Gif,
    Png,
    Page,
}

impl Args {
    /// What is asked for, by a flag or by the name of the output.
    fn picture(&self) -> Result<Picture> {
        let ending = self.out.as_deref().and_then(Path::extension).and_then(OsStr::to_str);
        match (&self.format, ending) {
            (Format { gif: true, .. }, _) => Ok(Picture::Gif),
            (Format { png: true, .. }, _) => Ok(Picture::Png),
            (Format { html: true, .. }, _) => Ok(Picture::Page),
            (_, Some("gif")) => Ok(Picture::Gif),
            (_, Some("png")) => Ok(Picture::Png),
            (_, Some("html")) => Ok(Picture::Page),
            _ => Err(Error::Usage("what is to be drawn? give --gif, --png or --html, or --out with a name that ends so".into())),
        }
    }
}
