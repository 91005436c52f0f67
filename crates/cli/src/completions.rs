//! `nonsmooth completions`.

use clap_complete::Shell;

use crate::{Exit, output};

/// Print a script that completes commands and options in a shell.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth completions bash > ~/.local/share/bash-completion/completions/nonsmooth
  nonsmooth completions zsh > ~/.zfunc/_nonsmooth
  nonsmooth completions fish > ~/.config/fish/completions/nonsmooth.fish";

/// Runs the command; `program` is all of it.
pub fn run(args: &Args, mut program: clap::Command) -> Exit {
    let mut script = vec![];
    clap_complete::generate(args.shell, &mut program, "nonsmooth", &mut script);
    output::print_bytes(&script);
    Exit::Solved
}
