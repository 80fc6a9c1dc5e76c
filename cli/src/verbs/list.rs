//! `arborloop list`: what comes with the program.

use crate::suite;
use crate::systems::Catalog;
use arborloop_sim::scenario;
use arborloop_sim::sensor::lidar;

pub(crate) fn list(catalog: &Catalog) {
    println!("scenarios");
    for (name, text) in scenario::EMBEDDED {
        println!("  {name:24} {}", first_line(text));
    }
    println!("suites");
    for (name, text) in suite::EMBEDDED {
        println!("  {name:24} {}", first_line(text));
    }
    println!("systems");
    for name in catalog.names() {
        println!("  {name}");
    }
    println!("robots");
    for (name, what) in [
        ("go1", "Unitree Go1 with a VLP-16: legs, by physics or kinematics"),
        ("jackal", "Clearpath Jackal with a VLP-16: four wheels, skid steering, by physics"),
        ("thorvald", "Thorvald II with an OS1-16: four wheels driven and steered, by physics"),
    ] {
        println!("  {name:24} {what}");
    }
    println!("lidars");
    for (name, text) in lidar::EMBEDDED {
        println!("  {name:24} {}", first_line(text));
    }
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches("# ")
}
