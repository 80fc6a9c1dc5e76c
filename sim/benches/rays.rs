//! How fast beams are cast: `cargo bench -p arborloop-sim --bench rays`.
//!
//! Three orchards of about 0.1, 1 and 10 million triangles, one core, process CPU time. Prints rays per second, memory,
//! build time, the cost of wind, and ratios to rapier's query pipeline, round by round. Flags:
//!
//! - `--scene S|M|L` (several allowed; all three unless said), `--rounds N` (5), `--poses N` (4)
//! - `--wind off|on|still-limbs|limbs` with `--serve` and `--export` (off)
//! - `--isa portable|avx2|avx512` (the fastest: avx2 where it is present)
//! - `--no-rapier` leaves rapier out
//! - `--export DIR` writes one scene, its rays and our hits as plain arrays
//! - `--serve` casts all rays of one scene for each line read, `find` or `cast`, and prints the CPU seconds
//!
//! Two figures: `find` is the tracer, which answers as other ray casters do: surface and distance in single precision.
//! `cast` is what a simulator asks for: the exact hit in double precision comes on top. Ratios to others take `find`.
//!
//! The cost of wind is told twice, each time against the same orchard in still air: trees that sway as one, and trees of
//! a trunk and twelve limbs (branch clusters) that sway on their own. What it costs to part trees into limbs is a third
//! figure, and the last is both together.

#[path = "rays/export.rs"]
mod export;
#[path = "rays/opponent.rs"]
mod opponent;
#[path = "rays/scene.rs"]
mod scene;

use arborloop_sim::optics::{Found, Hit, InstructionSet, Optics, Ray};
use cpu_time::ProcessTime;
use scene::{Air, Size};
use std::io::Write;

/// What the command line asks for.
struct Wanted {
    sizes: Vec<Size>,
    rounds: usize,
    poses: usize,
    air: Air,
    isa: InstructionSet,
    rapier: bool,
    export: Option<std::path::PathBuf>,
    serve: bool,
}

fn main() {
    let wanted = match read_flags(std::env::args().skip(1)) {
        Ok(wanted) => wanted,
        Err(message) => {
            eprintln!("rays: {message}");
            std::process::exit(2);
        }
    };
    // One core: whoever wants a ratio wants it per core.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be started");
    pool.install(|| run(&wanted));
}

fn read_flags(mut flags: impl Iterator<Item = String>) -> Result<Wanted, String> {
    let mut wanted = Wanted {
        sizes: Vec::new(),
        rounds: 5,
        poses: 4,
        air: Air::Still,
        isa: InstructionSet::fastest_to_trace(),
        rapier: true,
        export: None,
        serve: false,
    };
    while let Some(flag) = flags.next() {
        let mut value = || flags.next().ok_or(format!("{flag} wants a value"));
        match flag.as_str() {
            "--scene" => wanted.sizes.push(Size::named(&value()?)?),
            "--rounds" => wanted.rounds = value()?.parse().map_err(|_| "--rounds wants a number")?,
            "--poses" => wanted.poses = value()?.parse().map_err(|_| "--poses wants a number")?,
            "--wind" => wanted.air = Air::named(&value()?)?,
            "--isa" => {
                wanted.isa = match value()?.as_str() {
                    "portable" => InstructionSet::Portable,
                    "avx2" => InstructionSet::Avx2,
                    "avx512" => InstructionSet::Avx512,
                    other => return Err(format!("--isa is portable, avx2 or avx512, not {other}")),
                }
            }
            "--no-rapier" => wanted.rapier = false,
            "--export" => wanted.export = Some(value()?.into()),
            "--serve" => wanted.serve = true,
            // What cargo itself adds.
            "--bench" => {}
            other => {
                return Err(format!("unknown flag {other}; the first lines of sim/benches/rays.rs name all"));
            }
        }
    }
    if wanted.sizes.is_empty() {
        wanted.sizes = if wanted.serve || wanted.export.is_some() {
            vec![Size::MEDIUM]
        } else {
            vec![Size::SMALL, Size::MEDIUM, Size::LARGE]
        };
    }
    Ok(wanted)
}

fn run(wanted: &Wanted) {
    if wanted.serve || wanted.export.is_some() {
        let size = wanted.sizes[0];
        let orchard = scene::orchard(size, wanted.air);
        let optics = Optics::new(&orchard.world).with_instruction_set(wanted.isa);
        let rays = scene::rays(&orchard, wanted.poses);
        let (mut hits, mut found) = (Vec::new(), Vec::new());
        if let Some(folder) = &wanted.export {
            optics.cast_all(&rays, &mut hits);
            if let Err(error) = export::write(folder, size, &orchard, &rays, &hits) {
                eprintln!("rays: {}: {error}", folder.display());
                std::process::exit(3);
            }
        }
        if wanted.serve {
            println!("ready {} {}", rays.len(), optics.bytes());
            for line in std::io::stdin().lines().map_while(Result::ok) {
                let seconds = match line.as_str() {
                    "find" => find_s(&optics, &rays, &mut found),
                    _ => cast_s(&optics, &rays, &mut hits),
                };
                println!("{seconds:.6}");
                let _ = std::io::stdout().flush();
            }
        }
        return;
    }
    println!("one core, {:?}, {} rounds, CPU time", wanted.isa, wanted.rounds);
    for &size in &wanted.sizes {
        measure(size, wanted);
    }
}

fn measure(size: Size, wanted: &Wanted) {
    let still = scene::orchard(size, Air::Still);
    let started = ProcessTime::now();
    let optics = Optics::new(&still.world).with_instruction_set(wanted.isa);
    let build_s = started.elapsed().as_secs_f64();
    let rays = scene::rays(&still, wanted.poses);
    println!(
        "\n{}: {} trees x {} leaves, {} prototypes, {:.3} million triangles, {} rays",
        size.name,
        size.trees,
        size.leaves,
        scene::PROTOTYPES,
        still.triangles() as f64 * 1e-6,
        rays.len()
    );
    println!("  built in {build_s:.2} s, {:.1} MB", optics.bytes() as f64 * 1e-6);
    let others = [Air::Wind, Air::StillLimbs, Air::Limbs].map(|air| {
        let orchard = scene::orchard(size, air);
        (air, Optics::new(&orchard.world).with_instruction_set(wanted.isa))
    });
    let rapier = wanted.rapier.then(|| opponent::Rapier::new(&still));
    // Rapier sees every eighth packet: enough for its speed, and a round stays short.
    let few: Vec<Ray> = rays.chunks(16).step_by(8).flatten().copied().collect();
    let (mut hits, mut found) = (Vec::new(), Vec::new());
    let mut rows: Vec<(String, Vec<f64>)> = Vec::new();
    for measure in ["find", "cast"] {
        rows.push((format!("{measure}: still air"), Vec::new()));
        rows.extend(others.iter().map(|(air, optics)| {
            (format!("{measure}: {} ({:.1} MB)", air.named_as(), optics.bytes() as f64 * 1e-6), Vec::new())
        }));
    }
    rows.push(("rapier3d-f64 query pipeline".into(), Vec::new()));
    rows.push(("cast: five rays a beam, one sweep".into(), Vec::new()));
    let five = scene::footprints(&rays[..rays.len() / wanted.poses]);
    // The first round warms up and does not count.
    for round in 0..=wanted.rounds {
        let per_ray = |seconds: f64, count: usize| seconds / count as f64 * 1e9;
        let mut times = vec![per_ray(find_s(&optics, &rays, &mut found), rays.len())];
        times.extend(others.iter().map(|(_, optics)| per_ray(find_s(optics, &rays, &mut found), rays.len())));
        times.push(per_ray(cast_s(&optics, &rays, &mut hits), rays.len()));
        times.extend(others.iter().map(|(_, optics)| per_ray(cast_s(optics, &rays, &mut hits), rays.len())));
        times.push(rapier.as_ref().map_or(f64::NAN, |rapier| {
            let started = ProcessTime::now();
            rapier.cast_all(&few);
            per_ray(started.elapsed().as_secs_f64(), few.len())
        }));
        times.push(per_ray(cast_s(&optics, &five, &mut hits), five.len()));
        if round > 0 {
            rows.iter_mut().zip(times).for_each(|((_, all), time)| all.push(time));
        }
    }
    // Each against still air in its own measure; rapier, which finds, against `find`.
    let (find, cast) = (rows[0].1.clone(), rows[4].1.clone());
    for (name, times) in rows.iter().filter(|(_, times)| !times.iter().any(|time| time.is_nan())) {
        let base = if name.starts_with("cast") { &cast } else { &find };
        let ratios: Vec<f64> = times.iter().zip(base).map(|(time, base)| time / base).collect();
        let shown: Vec<String> = ratios.iter().map(|ratio| format!("{ratio:.2}")).collect();
        let time = median(times);
        println!(
            "  {name:40} {time:8.1} ns a ray {:7.2} Mray/s   to still air {:6.2}  [{}]",
            1e3 / time,
            median(&ratios),
            shown.join(" ")
        );
    }
    for (measure, at) in [("find", 0), ("cast", 4)] {
        let ratio = |of: usize, to: usize| {
            let pairs = rows[at + of].1.iter().zip(&rows[at + to].1);
            median(&pairs.map(|(time, base)| time / base).collect::<Vec<f64>>())
        };
        let [still, wind, still_limbs, limbs] = [0, 1, 2, 3];
        println!("  {measure}: cost of wind on against off");
        println!("    trees that sway as one                {:6.3}", ratio(wind, still));
        println!("    branch clusters, twelve limbs a tree  {:6.3}", ratio(limbs, still_limbs));
        println!(
            "    (branch clusters against whole trees: {:.3} in still air, {:.3} in wind against still air)",
            ratio(still_limbs, still),
            ratio(limbs, still)
        );
    }
    let sweep_ms = median(&rows[rows.len() - 1].1) * five.len() as f64 * 1e-6;
    println!("  a whole sweep with five rays a beam: {sweep_ms:.1} ms of the 100 ms that it lasts");
}

/// CPU seconds of the tracer alone, sweep after sweep.
fn find_s(optics: &Optics, rays: &[Ray], found: &mut Vec<Option<Found>>) -> f64 {
    let started = ProcessTime::now();
    rays.chunks(scene::SWEEP).for_each(|sweep| optics.find_all(sweep, found));
    started.elapsed().as_secs_f64()
}

/// CPU seconds of casting sweep after sweep, as a simulator does.
fn cast_s(optics: &Optics, rays: &[Ray], hits: &mut Vec<Option<Hit>>) -> f64 {
    let started = ProcessTime::now();
    rays.chunks(scene::SWEEP).for_each(|sweep| optics.cast_all(sweep, hits));
    started.elapsed().as_secs_f64()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
