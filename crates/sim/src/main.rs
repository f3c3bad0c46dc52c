//! The program `wakescope`; everything is in the library.

fn main() -> std::process::ExitCode {
    wakescope_sim::cli::main(std::env::args_os()).into()
}
