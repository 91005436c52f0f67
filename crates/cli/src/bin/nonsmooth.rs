//! `nonsmooth`: solve, check, describe and generate problems of nonsmooth mechanics.

fn main() -> std::process::ExitCode {
    nonsmooth_cli::program()
}
