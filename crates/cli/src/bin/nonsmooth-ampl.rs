//! `nonsmooth-ampl`: a solver for AMPL and Pyomo, `nonsmooth-ampl STUB -AMPL [key=value …]`.

#[global_allocator]
static ALLOCATOR: nonsmooth_linalg::LargePages = nonsmooth_linalg::LargePages;

fn main() -> std::process::ExitCode {
    nonsmooth_cli::program_for_ampl()
}
