//! The binary `arborloop`: the verbs with the systems that we ship.

use std::process::ExitCode;

fn main() -> ExitCode {
    arborloop::main_with(arborloop::Catalog::default())
}
