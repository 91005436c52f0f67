//! `nonsmooth-ampl`: a solver for AMPL and Pyomo, `nonsmooth-ampl STUB -AMPL [key=value …]`.

fn main() -> std::process::ExitCode {
    nonsmooth_cli::program_for_ampl()
}
