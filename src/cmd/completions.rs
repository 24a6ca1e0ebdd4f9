use super::{Context, Outcome, output};
use crate::error::Result;
use clap::Command;
use clap_complete::{Shell, generate};

/// Print what makes a shell complete hilt's commands and flags.
///
/// bash: into ~/.local/share/bash-completion/completions/hilt; zsh: as _hilt into a directory of $fpath; fish: into
/// ~/.config/fish/completions/hilt.fish. `make install` puts them under PREFIX/share.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt completions bash")]
pub struct Args {
    /// The shell
    shell: Shell,
}

pub fn run(args: &Args, mut command: Command, context: &Context) -> Result<Outcome> {
    context.console.open_log()?;
    let (name, mut text) = (command.get_name().to_string(), Vec::new());
    generate(args.shell, &mut command, name, &mut text);
    output::print(&String::from_utf8_lossy(&text)).map(|()| Outcome::Done)
}
