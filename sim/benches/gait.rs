//! The study of the physics gait: every acceptance bar with its figure. `cargo bench -p arborloop-sim --bench gait`;
//! words after `--` choose among: stand, flat, uneven, hard, speed, steps.

#![allow(clippy::unwrap_used)] // A development tool.

#[path = "../tests/walked/mod.rs"]
mod walked;

use arborloop_robots::{Command, TrotSettings};
use cpu_time::ThreadTime;
use walked::{Guide, Walk, ground, walk};

fn main() {
    let seconds: f64 = std::env::var("SECONDS_OF_WALK").ok().and_then(|s| s.parse().ok()).unwrap_or(10.0);
    let ahead = Guide::Always(Command { forward_mps: 0.5, turn_radps: 0.0 });
    let settings = TrotSettings::default();
    let words: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with('-')).collect();
    let asked = |word: &str| words.is_empty() || words.iter().any(|w| w == word);
    if asked("stand") {
        let still = Guide::Always(Command::default());
        let (w, rtf) = timed(|| walk(&ground(0.0, 0.0, 1), &settings, &still, seconds, 1), seconds);
        stand(&w, rtf);
    }
    if asked("flat") {
        let (w, rtf) = timed(|| walk(&ground(0.0, 0.0, 1), &settings, &ahead, seconds, 1), seconds);
        line("flat straight", &w, rtf);
    }
    if asked("uneven") {
        let (w, rtf) =
            timed(|| walk(&ground(0.03, 5.0, 1), &settings, &Guide::Rectangle(0.5), seconds, 1), seconds);
        line("uneven rectangle", &w, rtf);
    }
}

fn timed(make: impl FnOnce() -> Walk, seconds: f64) -> (Walk, f64) {
    let from = ThreadTime::now();
    let made = make();
    (made, seconds / from.elapsed().as_secs_f64())
}

fn stand(w: &Walk, rtf: f64) {
    for t in [0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 9000] {
        let Some(s) = w.states.get(t) else { continue };
        let f: nalgebra::Vector3<f64> = s.loads.map(|l| l.foot_forces_n.iter().sum()).unwrap_or_default();
        println!(
            "{t} z {:.5} x {:.5} v {:.5} f {:.3} {:.3} {:.3} rpy {:.4?}",
            s.world_from_base.translation.z,
            s.world_from_base.translation.x,
            s.linear_mps.norm(),
            f.x,
            f.y,
            f.z,
            s.world_from_base.rotation.euler_angles()
        );
    }
    println!("fall {:?} rtf {rtf:.2}", w.fall);
}

fn line(name: &str, w: &Walk, rtf: f64) {
    println!("{name}: fall {:?} after {} rtf {rtf:.2}", w.fall, w.states.len());
    if w.states.len() > 4000 {
        println!("{:#.3?}", w.measured());
    }
}
