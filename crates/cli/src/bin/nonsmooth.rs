//! `nonsmooth`: solve, check, describe and generate problems of nonsmooth mechanics.

#[global_allocator]
static ALLOCATOR: nonsmooth_linalg::LargePages = nonsmooth_linalg::LargePages;

fn main() -> std::process::ExitCode {
    nonsmooth_cli::program()
}
