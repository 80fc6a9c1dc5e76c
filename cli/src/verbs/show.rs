//! `arborloop show`: a scenario with every default, pictures of its world, or a robot.

use crate::arguments::{Show, Shown};
use crate::failure::Failure;
use crate::load;
use crate::render::{Camera, range_image, render};
use arborloop_base::{Observation, Seed};
use arborloop_sim::sensor::LidarModel;
use arborloop_sim::sensor::lidar::EMBEDDED;
use arborloop_sim::{Document, Scenario, Simulator};
use nalgebra::{Point2, Point3, Vector3};
use std::path::Path;

pub(crate) fn show(verb: &Show) -> Result<(), Failure> {
    match &verb.what {
        Shown::Scenario { scenario, set } => {
            print!("{}", load::checked(scenario, Path::new(""), set)?.resolved());
        }
        Shown::World { scenario, seed, set, output } => {
            let scenario = load::checked(scenario, Path::new(""), set)?;
            world(&scenario, Seed(seed.unwrap_or(scenario.seed)), output)?;
        }
        Shown::Lidar { lidar } => match EMBEDDED.iter().find(|(name, _)| name == lidar) {
            Some((_, text)) => print!("{text}"),
            None => {
                let model = LidarModel::read(&load::file(Path::new(lidar))?)?;
                print!("{}", Document::of(&model)?.text);
            }
        },
        Shown::Robot { robot, meshes } => super::robot::show(robot, meshes)?,
    }
    Ok(())
}

/// Pixels of a picture.
const SIZE: [usize; 2] = [1280, 720];
/// A top view shows at most this much across, meters: wider ones would not show a tree.
const ACROSS_M_MAX: f64 = 48.0;

fn world(scenario: &Scenario, seed: Seed, output: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(output).map_err(Failure::file(output, "make the folder"))?;
    let mut simulator = Simulator::new(scenario, seed);
    let (sweep, labels) = loop {
        // A scenario's lidar turns at least 5 times a second: the first sweep is near.
        let found = simulator.step().into_iter().find_map(|observation| match observation {
            Observation::Sweep(sweep) => Some(sweep),
            _ => None,
        });
        if let Some(sweep) = found {
            break (sweep, simulator.labels().to_vec());
        }
    };
    let (low, high) = route_bounds(scenario);
    let margin_m = 6.0;
    let across_m = (high - low).x.max((high - low).y * SIZE[0] as f64 / SIZE[1] as f64) + 2.0 * margin_m;
    let top = Camera::Top {
        center: if across_m > ACROSS_M_MAX {
            low + (high - low).map(|side| side.min(24.0)) / 2.0
        } else {
            nalgebra::center(&low, &high)
        },
        pixel_m: across_m.min(ACROSS_M_MAX) / SIZE[0] as f64,
        size: SIZE,
    };
    let start = scenario.start.pose();
    let ahead = start * Vector3::new(1.0, 0.0, 0.0).xy();
    let beside = nalgebra::Vector2::new(-ahead.y, ahead.x);
    let ground = |place: Point2<f64>| simulator.world().terrain.height_m(place.x, place.y);
    let lifted = |place: Point2<f64>, above_m: f64| Point3::new(place.x, place.y, ground(place) + above_m);
    let here = Point2::from(start.translation.vector);
    let view = Camera::Eye {
        from: lifted(here - ahead * 4.0 + beside * 0.8, 2.2),
        at: lifted(here + ahead * 8.0, 0.8),
        view_rad: 75.0_f64.to_radians(),
        size: SIZE,
    };
    let now = simulator.now();
    render(simulator.optics(), &top, now).save(&output.join("top.png"))?;
    render(simulator.optics(), &view, now).save(&output.join("view.png"))?;
    range_image(&sweep, &labels).save(&output.join("sweep.png"))?;
    println!("{}: top.png, view.png, sweep.png in {}", scenario.name, output.display());
    Ok(())
}

/// The rectangle around the start and the route's waypoints, world frame.
fn route_bounds(scenario: &Scenario) -> (Point2<f64>, Point2<f64>) {
    let start = scenario.start.pose();
    let here = Point2::from(start.translation.vector);
    scenario.route.waypoints_m.iter().fold((here, here), |(low, high), place| {
        let place = start * Point2::from(*place);
        (low.inf(&place), high.sup(&place))
    })
}
