//! `excite`: the program. Each command is a file in `cli/`.

fn main() -> std::process::ExitCode {
    excite::cli::main()
}
