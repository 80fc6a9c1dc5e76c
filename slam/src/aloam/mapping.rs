//! From the sweep to the map: edges to lines and planes through the five nearest points of a map of voxel means (LOAM,
//! section VI).

use super::features::{Cloud, Features};
use super::registration::{Pair, align};
use super::settings::AloamSettings;
use super::voxels::Thinner;
use crate::kdtree::KdTree;
use arborloop_base::Pose;
use nalgebra::{Matrix3, Point3, SMatrix, SVector, SymmetricEigen, Vector3};
use std::collections::BTreeMap;

/// Rounds of looking for neighbors and aligning.
const ROUNDS: usize = 2;
/// Side of the cubes in which the map is kept, meters.
const CUBE_M: f64 = 50.0;
/// Cubes around the lidar's own whose points take part, along x, y and z.
const AROUND: [i64; 3] = [2, 2, 1];
/// A map of no more edges and planes than this is not aligned with.
const MAP_EDGES_MIN: usize = 10;
const MAP_PLANES_MIN: usize = 50;
/// The fifth neighbor must be nearer than this, meters^2.
const FAR_M2: f64 = 1.0;
/// Neighbors make a line when their largest extent's eigenvalue is so many times the next.
const LINE_RATIO: f64 = 3.0;
/// Neighbors make a plane when none is farther from it, meters.
const PLANE_M: f64 = 0.2;
/// Steps after which an eigenvalue decomposition of three rows has long converged.
const EIGEN_STEPS_MAX: usize = 100;

type Place = [i64; 3];

/// Points of one cube of the map, thinned.
#[derive(Debug, Clone, Default)]
struct Cube {
    edges: Vec<Vector3<f64>>,
    planes: Vec<Vector3<f64>>,
}

/// The map and what the odometry's frame has drifted by.
///
/// The public program keeps 21 x 21 x 11 cubes around the lidar and forgets farther ones; nothing that walks an orchard
/// gets there, so here every cube stays.
#[derive(Debug, Clone)]
pub(crate) struct Mapping {
    cubes: BTreeMap<Place, Cube>,
    map_from_odometry: Pose,
    edge_tree: KdTree,
    plane_tree: KdTree,
    around_edges: Vec<Vector3<f64>>,
    around_planes: Vec<Vector3<f64>>,
    edges: Vec<Vector3<f64>>,
    planes: Vec<Vector3<f64>>,
    raw: Vec<Vector3<f64>>,
    pairs: Vec<Pair>,
    thinner: Thinner,
}

impl Default for Mapping {
    fn default() -> Self {
        Mapping {
            cubes: BTreeMap::new(),
            map_from_odometry: Pose::identity(),
            edge_tree: KdTree::default(),
            plane_tree: KdTree::default(),
            around_edges: Vec::new(),
            around_planes: Vec::new(),
            edges: Vec::new(),
            planes: Vec::new(),
            raw: Vec::new(),
            pairs: Vec::new(),
            thinner: Thinner::default(),
        }
    }
}

impl Mapping {
    /// Aligns a sweep with the map, beginning at the odometry's pose, and adds it: the lidar in the map, and how many
    /// pairs the last round was aligned by.
    pub(crate) fn refine(
        &mut self,
        features: &Features,
        odometry_from_lidar: &Pose,
        settings: &AloamSettings,
    ) -> (Pose, usize) {
        let mut map_from_lidar = self.map_from_odometry * odometry_from_lidar;
        self.thin_sweep(features, settings);
        let places = around(&map_from_lidar);
        self.gather(&places);
        self.pairs.clear();
        if self.around_edges.len() > MAP_EDGES_MIN && self.around_planes.len() > MAP_PLANES_MIN {
            self.edge_tree.build(self.around_edges.iter().copied());
            self.plane_tree.build(self.around_planes.iter().copied());
            for _ in 0..ROUNDS {
                self.pair(&map_from_lidar);
                map_from_lidar = align(&map_from_lidar, &self.pairs);
            }
        }
        map_from_lidar.rotation.renormalize();
        self.map_from_odometry = map_from_lidar * odometry_from_lidar.inverse();
        self.add(&map_from_lidar, &places, settings);
        (map_from_lidar, self.pairs.len())
    }

    fn thin_sweep(&mut self, features: &Features, settings: &AloamSettings) {
        let mut thin = |cloud: &Cloud, voxel_m: f64, thinned: &mut Vec<Vector3<f64>>| {
            thinned.clear();
            self.thinner.thin(&cloud.points, voxel_m, thinned);
        };
        thin(&features.edges, settings.edge_voxel_m, &mut self.edges);
        thin(&features.planes, settings.plane_voxel_m, &mut self.planes);
    }

    fn gather(&mut self, places: &[Place]) {
        self.around_edges.clear();
        self.around_planes.clear();
        for cube in places.iter().filter_map(|place| self.cubes.get(place)) {
            self.around_edges.extend(&cube.edges);
            self.around_planes.extend(&cube.planes);
        }
    }

    fn pair(&mut self, map_from_lidar: &Pose) {
        self.pairs.clear();
        for point in &self.edges {
            let at = (map_from_lidar * Point3::from(*point)).coords;
            let line = five(&self.edge_tree, &self.around_edges, &at).and_then(|five| line_through(&five));
            self.pairs.extend(line.map(|(place, along)| Pair::on_line(*point, place, along)));
        }
        for point in &self.planes {
            let at = (map_from_lidar * Point3::from(*point)).coords;
            let plane =
                five(&self.plane_tree, &self.around_planes, &at).and_then(|five| plane_through(&five));
            self.pairs.extend(plane.map(|(place, normal)| Pair::on_plane(*point, place, normal)));
        }
    }

    /// Adds the sweep to its cubes and thins the cubes around.
    fn add(&mut self, map_from_lidar: &Pose, places: &[Place], settings: &AloamSettings) {
        for point in &self.edges {
            let at = (map_from_lidar * Point3::from(*point)).coords;
            self.cubes.entry(cube_of(&at)).or_default().edges.push(at);
        }
        for point in &self.planes {
            let at = (map_from_lidar * Point3::from(*point)).coords;
            self.cubes.entry(cube_of(&at)).or_default().planes.push(at);
        }
        for place in places {
            let Some(cube) = self.cubes.get_mut(place) else { continue };
            let kinds =
                [(&mut cube.edges, settings.edge_voxel_m), (&mut cube.planes, settings.plane_voxel_m)];
            for (points, voxel_m) in kinds {
                std::mem::swap(points, &mut self.raw);
                points.clear();
                self.thinner.thin(&self.raw, voxel_m, points);
            }
        }
    }
}

fn cube_of(at: &Vector3<f64>) -> Place {
    [at.x, at.y, at.z].map(|along_m| ((along_m + 0.5 * CUBE_M) / CUBE_M).floor() as i64)
}

fn around(map_from_lidar: &Pose) -> Vec<Place> {
    let [x, y, z] = cube_of(&map_from_lidar.translation.vector);
    let mut places = Vec::with_capacity(75);
    for i in -AROUND[0]..=AROUND[0] {
        for j in -AROUND[1]..=AROUND[1] {
            for k in -AROUND[2]..=AROUND[2] {
                places.push([x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)]);
            }
        }
    }
    places
}

fn five(tree: &KdTree, points: &[Vector3<f64>], at: &Vector3<f64>) -> Option<[Vector3<f64>; 5]> {
    let nearest = tree.nearest::<5>(at);
    let all: &[(f64, u32); 5] = nearest.all().try_into().ok()?;
    (all[4].0 < FAR_M2).then(|| all.map(|(_, index)| points[index as usize]))
}

/// A place on the line through five points and its direction; `None` when they make none.
fn line_through(points: &[Vector3<f64>; 5]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mean = points.iter().sum::<Vector3<f64>>() / 5.0;
    let spread: Matrix3<f64> = points.iter().map(|point| (point - mean) * (point - mean).transpose()).sum();
    let eigen = SymmetricEigen::try_new(spread, 1e-12, EIGEN_STEPS_MAX)?;
    let largest = eigen.eigenvalues.imax();
    let others = (0..3).filter(|axis| *axis != largest).map(|axis| eigen.eigenvalues[axis]);
    let next = others.fold(0.0, f64::max);
    let along = eigen.eigenvectors.column(largest).into_owned();
    (eigen.eigenvalues[largest] > LINE_RATIO * next).then_some((mean, along))
}

/// A place on the plane through five points and its normal; `None` when one of them lies apart from it.
///
/// The plane is `n . p = -1`, as in the public program: one that holds the map's origin has no such form.
fn plane_through(points: &[Vector3<f64>; 5]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let rows = SMatrix::<f64, 5, 3>::from_fn(|row, axis| points[row][axis]);
    let qr = rows.qr();
    let right = qr.q().transpose() * SVector::<f64, 5>::repeat(-1.0);
    let solved = qr.r().solve_upper_triangular(&right)?;
    let length = solved.norm();
    if !length.is_finite() || length <= 0.0 {
        return None;
    }
    let normal = solved / length;
    let offset_m = 1.0 / length;
    let flat = points.iter().all(|point| (normal.dot(point) + offset_m).abs() <= PLANE_M);
    flat.then(|| (normal * -offset_m, normal))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_points_on_a_pole_make_a_line_and_a_cloud_makes_none() {
        let pole = [0.0, 0.2, 0.4, 0.6, 0.8].map(|z| Vector3::new(2.0, -1.0, z));
        let (place, along) = line_through(&pole).unwrap();
        assert!(along.z.abs() > 1.0 - 1e-12 && (place.xy() - pole[0].xy()).norm() < 1e-12);
        let cloud = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        assert_eq!(line_through(&cloud.map(Vector3::from)), None);
    }

    #[test]
    fn five_points_on_the_ground_make_a_plane_and_a_step_makes_none() {
        let ground = [[1.0, 0.0], [2.0, 0.3], [1.2, 1.0], [0.4, 0.7], [1.6, -0.8]];
        let points = ground.map(|[x, y]| Vector3::new(x, y, -0.5 + 0.1 * x));
        let (place, normal) = plane_through(&points).unwrap();
        assert!(points.iter().all(|point| normal.dot(&(point - place)).abs() < 1e-12));
        let mut step = points;
        step[4].z += 1.0;
        assert_eq!(plane_through(&step), None);
    }
}
