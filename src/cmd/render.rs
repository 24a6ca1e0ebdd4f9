use super::places::{Content, Places};
use super::{Context, Outcome};
use crate::data::{atomic, recording};
use crate::error::{Error, Result};
use crate::report::render::{GifOptions, write_gif, write_png_sheet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Draw a recorded episode: an animated GIF, or a contact sheet as PNG.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  hilt render rollouts/episode-00000.mcap --out episode.gif\n  hilt render rollouts/episode-00000.mcap --png --columns 5 --rows 2"
)]
pub struct Args {
    /// Recording
    #[arg(value_name = "FILE.mcap")]
    recording: PathBuf,
    #[command(flatten)]
    format: Format,
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
    /// File to write [default: in the working directory, the recording's name with .gif or .png]
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
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let is_gif = args.is_gif()?;
    let (ending, content) = if is_gif { ("gif", Content::Gif) } else { ("png", Content::Png) };
    // Not beside the recording: a directory of recordings is an artefact of its own.
    let name = || Path::new(args.recording.file_name().unwrap_or_default()).with_extension(ending);
    let out = args.out.clone().unwrap_or_else(name);
    Places::new().read(&args.recording).write("--out", &out, content).check(&context.console)?;
    let (episode, _) = recording::read(&args.recording)?;
    let size = (args.width, args.height);
    let mut bytes = Vec::new();
    if is_gif {
        let options = GifOptions { width: args.width, height: args.height, every_n_steps: args.every, fps: args.fps };
        write_gif(&episode, &options, &context.interrupt, &mut bytes)?;
    } else {
        write_png_sheet(&episode, (args.columns, args.rows), size, &context.interrupt, &mut bytes)?;
    }
    atomic::write_bytes(&out, &bytes)?;
    context.console.say(&format!("render: wrote {}", out.display()));
    Ok(Outcome::Done)
}

impl Args {
    /// Whether an animation is asked for, by a flag or by the name of the output.
    fn is_gif(&self) -> Result<bool> {
        let ending = self.out.as_deref().and_then(Path::extension);
        match (self.format.gif, self.format.png) {
            (false, false) if ending == Some(OsStr::new("gif")) => Ok(true),
            (false, false) if ending == Some(OsStr::new("png")) => Ok(false),
            (false, false) => {
                Err(Error::Usage("what is to be drawn? give --gif, --png, or --out with a name that ends so".into()))
            }
            (gif, _) => Ok(gif),
        }
    }
}
