//! Motion from one sweep to the next: edge points to lines and flat points to planes of the sweep before (LOAM, section V-B).

use super::features::{Cloud, Features};
use super::registration::{Pair, align};
use crate::kdtree::KdTree;
use arborloop_base::Pose;
use nalgebra::{Point3, Vector3};

/// Rounds of looking for neighbors and aligning.
const ROUNDS: usize = 2;
/// Neighbors farther away are none, meters^2.
const FAR_M2: f64 = 25.0;
/// The second and third neighbor lie within this many rings.
const NEARBY_RINGS: usize = 2;

/// The sweep before and the path so far.
#[derive(Debug, Clone)]
pub(crate) struct SweepOdometry {
    edges: Cloud,
    planes: Cloud,
    edge_tree: KdTree,
    plane_tree: KdTree,
    pairs: Vec<Pair>,
    /// The motion of the last interval: this sweep in the frame of the one before.
    pub(crate) before_from_now: Pose,
    /// The lidar in the frame of the first sweep, as summed up.
    pub(crate) first_from_now: Pose,
}

impl Default for SweepOdometry {
    fn default() -> Self {
        SweepOdometry {
            edges: Cloud::default(),
            planes: Cloud::default(),
            edge_tree: KdTree::default(),
            plane_tree: KdTree::default(),
            pairs: Vec::new(),
            before_from_now: Pose::identity(),
            first_from_now: Pose::identity(),
        }
    }
}

impl SweepOdometry {
    /// Follows a sweep; how many pairs the last round was aligned by. The last motion is the first guess: constant velocity.
    pub(crate) fn follow(&mut self, features: &Features) -> usize {
        if self.edge_tree.len() + self.plane_tree.len() > 0 {
            for _ in 0..ROUNDS {
                self.pairs.clear();
                for point in &features.sharp.points {
                    self.pairs.extend(self.on_edge(point));
                }
                for point in &features.flat.points {
                    self.pairs.extend(self.on_plane(point));
                }
                self.before_from_now = align(&self.before_from_now, &self.pairs);
            }
            self.first_from_now *= self.before_from_now;
            self.first_from_now.rotation.renormalize();
        }
        self.keep(features);
        self.pairs.len()
    }

    /// The line through the nearest edge point and the nearest one of a nearby ring.
    fn on_edge(&self, point: &Vector3<f64>) -> Option<Pair> {
        let at = (self.before_from_now * Point3::from(*point)).coords;
        let first = nearest(&self.edge_tree, &at)?;
        let ring = self.edges.ring_of(first);
        let second = beside(&self.edges, ring, &at)?;
        let (a, b) = (self.edges.points[first], self.edges.points[second]);
        let along = (a - b).try_normalize(1e-9)?;
        Some(Pair::on_line(*point, a, along))
    }

    /// The plane through the nearest planar point, the nearest other one of its ring and the nearest one of a nearby ring.
    fn on_plane(&self, point: &Vector3<f64>) -> Option<Pair> {
        let at = (self.before_from_now * Point3::from(*point)).coords;
        let first = nearest(&self.plane_tree, &at)?;
        let ring = self.planes.ring_of(first);
        let (start, own) = self.planes.of_rings(ring, ring);
        let second = closest(&at, (start..).zip(own).filter(|(index, _)| *index != first))?;
        let third = beside(&self.planes, ring, &at)?;
        let [a, b, c] = [first, second, third].map(|index| self.planes.points[index]);
        let normal = (a - b).cross(&(a - c)).try_normalize(1e-9)?;
        Some(Pair::on_plane(*point, a, normal))
    }

    fn keep(&mut self, features: &Features) {
        self.edges.clone_from(&features.edges);
        self.planes.clone_from(&features.planes);
        self.edge_tree.build(self.edges.points.iter().copied());
        self.plane_tree.build(self.planes.points.iter().copied());
    }
}

fn nearest(tree: &KdTree, at: &Vector3<f64>) -> Option<usize> {
    let (square_m2, index) = *tree.nearest::<1>(at).all().first()?;
    (square_m2 < FAR_M2).then_some(index as usize)
}

/// The nearest point of the rings just below and above a ring.
fn beside(cloud: &Cloud, ring: usize, at: &Vector3<f64>) -> Option<usize> {
    let below = if ring > 0 {
        cloud.of_rings(ring.saturating_sub(NEARBY_RINGS), ring - 1)
    } else {
        (0, &[] as &[Vector3<f64>])
    };
    let above = cloud.of_rings(ring + 1, ring + NEARBY_RINGS);
    closest(at, (below.0..).zip(below.1).chain((above.0..).zip(above.1)))
}

fn closest<'a>(at: &Vector3<f64>, points: impl Iterator<Item = (usize, &'a Vector3<f64>)>) -> Option<usize> {
    let squares = points.map(|(index, point)| ((point - at).norm_squared(), index));
    let (square_m2, index) = squares.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
    (square_m2 < FAR_M2).then_some(index)
}
