//! Edges and planes of a sweep, by the curvature along each ring (LOAM, section V-A).

use super::settings::AloamSettings;
use super::voxels::Thinner;
use arborloop_base::Sweep;
use nalgebra::Vector3;

/// Neighbors to either side that make the curvature, and that a chosen point rules out.
const SIDE: usize = 5;
/// Sectors of a ring that each give their share of features.
const SECTORS: usize = 6;
/// Curvatures above this are edges, below it planes, meters^2.
const CURVATURE_M2: f64 = 0.1;
/// Per sector: sharpest edges, all edges, flattest planes.
const SHARP: usize = 2;
const EDGES: usize = 20;
const FLAT: usize = 4;
/// Neighbors farther apart than this do not lie on the same surface, meters^2.
const GAP_M2: f64 = 0.05;
/// Planar points of a ring are averaged in voxels of this side, meters.
const RING_VOXEL_M: f64 = 0.2;
/// No lidar of many rings sees farther; what claims to is a fault, meters.
const RANGE_M_MAX: f64 = 1000.0;

/// Points in the lidar frame, meters, in the order of their rings.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cloud {
    pub(crate) points: Vec<Vector3<f64>>,
    /// Where each ring ends; it begins where the one before ends.
    ends: Vec<usize>,
}

/// The features of one sweep.
#[derive(Debug, Clone, Default)]
pub(crate) struct Features {
    /// The sharpest edges: what is matched to the sweep before.
    pub(crate) sharp: Cloud,
    /// All edges: what the next sweep and the map are matched with.
    pub(crate) edges: Cloud,
    /// The flattest points: what is matched to the sweep before.
    pub(crate) flat: Cloud,
    /// All that is no edge, thinned: what the next sweep and the map are matched with.
    pub(crate) planes: Cloud,
}

/// What a point was chosen as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Other,
    Edge,
}

/// Finds features; keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Extractor {
    rings: Vec<Vec<Vector3<f64>>>,
    curvatures: Vec<f64>,
    order: Vec<u32>,
    is_taken: Vec<bool>,
    kinds: Vec<Kind>,
    other: Vec<Vector3<f64>>,
    thinner: Thinner,
}

impl Cloud {
    /// The points of the rings `first..=last`, as far as there are such rings, and where they begin.
    pub(crate) fn of_rings(&self, first: usize, last: usize) -> (usize, &[Vector3<f64>]) {
        let end = match self.ends.get(last.min(self.ends.len().saturating_sub(1))) {
            Some(end) => *end,
            None => return (0, &[]),
        };
        let start = if first == 0 { 0 } else { self.ends.get(first - 1).copied().unwrap_or(end) };
        (start, &self.points[start..end.max(start)])
    }

    /// The ring of a point.
    pub(crate) fn ring_of(&self, index: usize) -> usize {
        self.ends.partition_point(|end| *end <= index)
    }

    fn clear(&mut self) {
        self.points.clear();
        self.ends.clear();
    }

    fn end_ring(&mut self) {
        self.ends.push(self.points.len());
    }
}

impl Extractor {
    /// Fills `features` from the first echoes of a sweep. Ring and firing order are the sweep's own; the public program
    /// has to guess both from the angles.
    pub(crate) fn extract(&mut self, sweep: &Sweep, settings: &AloamSettings, features: &mut Features) {
        self.read(sweep, settings.range_m_min);
        for cloud in [&mut features.sharp, &mut features.edges, &mut features.flat, &mut features.planes] {
            cloud.clear();
        }
        let rings = std::mem::take(&mut self.rings);
        for ring in &rings {
            // Five points at either end have no curvature, and six sectors need as many points.
            if ring.len() >= 2 * SIDE + 1 + SECTORS {
                self.ring(ring, features);
            }
            features.sharp.end_ring();
            features.edges.end_ring();
            features.flat.end_ring();
            features.planes.end_ring();
        }
        self.rings = rings;
    }

    fn read(&mut self, sweep: &Sweep, range_m_min: f64) {
        let rings = usize::from(sweep.rings.max(1));
        self.rings.iter_mut().for_each(Vec::clear);
        self.rings.resize(rings, Vec::new());
        for one in sweep.returns.iter().filter(|one| one.number == 0 && usize::from(one.ring) < rings) {
            let seen = one.range_m.is_some_and(|range_m| range_m >= range_m_min && range_m <= RANGE_M_MAX);
            let Some(at) = one.point().filter(|at| seen && at.coords.iter().all(|n| n.is_finite())) else {
                continue;
            };
            self.rings[usize::from(one.ring)].push(at.coords);
        }
    }

    fn ring(&mut self, ring: &[Vector3<f64>], features: &mut Features) {
        self.curvatures.clear();
        self.curvatures.resize(ring.len(), 0.0);
        for index in SIDE..ring.len() - SIDE {
            let around: Vector3<f64> = ring[index - SIDE..=index + SIDE].iter().sum();
            self.curvatures[index] = (around - ring[index] * (2 * SIDE + 1) as f64).norm_squared();
        }
        self.is_taken.clear();
        self.is_taken.resize(ring.len(), false);
        self.kinds.clear();
        self.kinds.resize(ring.len(), Kind::Other);
        self.other.clear();
        let (first, last) = (SIDE, ring.len() - SIDE - 1);
        for sector in 0..SECTORS {
            let low = first + (last - first) * sector / SECTORS;
            let high = first + (last - first) * (sector + 1) / SECTORS;
            self.sector(ring, low, high, features);
        }
        self.thinner.thin(&self.other, RING_VOXEL_M, &mut features.planes.points);
    }

    /// Chooses the features of the points `low..high` of a ring.
    fn sector(&mut self, ring: &[Vector3<f64>], low: usize, high: usize, features: &mut Features) {
        self.order.clear();
        self.order.extend(low as u32..high as u32);
        let curvatures = &self.curvatures;
        let rank = |a: &u32, b: &u32| curvatures[*a as usize].total_cmp(&curvatures[*b as usize]);
        self.order.sort_unstable_by(|a, b| rank(a, b).then(a.cmp(b)));
        let mut edges = 0;
        for index in self.order.iter().rev().map(|index| *index as usize) {
            if self.is_taken[index] || self.curvatures[index] <= CURVATURE_M2 {
                continue;
            }
            edges += 1;
            if edges > EDGES {
                break;
            }
            if edges <= SHARP {
                features.sharp.points.push(ring[index]);
            }
            features.edges.points.push(ring[index]);
            self.kinds[index] = Kind::Edge;
            take(ring, &mut self.is_taken, index);
        }
        let mut flat = 0;
        for index in self.order.iter().map(|index| *index as usize) {
            if self.is_taken[index] || self.curvatures[index] >= CURVATURE_M2 {
                continue;
            }
            features.flat.points.push(ring[index]);
            flat += 1;
            if flat >= FLAT {
                break;
            }
            take(ring, &mut self.is_taken, index);
        }
        let other = (low..high).filter(|index| self.kinds[*index] == Kind::Other);
        self.other.extend(other.map(|index| ring[index]));
    }
}

/// Rules out a point and its neighbors on the same surface.
fn take(ring: &[Vector3<f64>], is_taken: &mut [bool], index: usize) {
    is_taken[index] = true;
    let joined = |pair: &&[Vector3<f64>]| (pair[0] - pair[1]).norm_squared() <= GAP_M2;
    let above = &ring[index..=(index + SIDE).min(ring.len() - 1)];
    let after = above.windows(2).take_while(joined).count();
    let below = &ring[index.saturating_sub(SIDE)..=index];
    let before = below.windows(2).rev().take_while(joined).count();
    is_taken[index - before..=index + after].fill(true);
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Return, Span, Time};
    use std::f64::consts::{PI, TAU};

    /// One turn of two rings in a square room of half side 4 m.
    fn room() -> Sweep {
        let start = Time::from_nanos(0);
        let returns = (0..1200_u32).flat_map(|column| {
            let azimuth_rad = PI - f64::from(column) / 1200.0 * TAU;
            let wall_m = 4.0 / azimuth_rad.sin().abs().max(azimuth_rad.cos().abs());
            (0..2_u16).map(move |ring| Return {
                azimuth_rad,
                elevation_rad: 0.0,
                range_m: Some(wall_m),
                ring,
                number: 0,
                fired_after: Span::from_nanos(i64::from(column) * 83_333),
                intensity: 0.0,
            })
        });
        Sweep { start, end: start + Span::from_millis(100), rings: 2, returns: returns.collect() }
    }

    fn features_of(sweep: &Sweep) -> Features {
        let mut features = Features::default();
        Extractor::default().extract(sweep, &AloamSettings::default(), &mut features);
        features
    }

    #[test]
    fn a_gap_makes_edges_and_a_wall_makes_planes() {
        let mut sweep = room();
        // A pole 2 m away in front of a wall; its returns lie between those of the wall.
        for one in sweep.returns.iter_mut().filter(|one| (one.azimuth_rad - 0.5).abs() < 0.05) {
            one.range_m = Some(2.0);
        }
        let features = features_of(&sweep);
        assert!(!features.sharp.points.is_empty());
        let pole = Vector3::new(0.5_f64.cos(), 0.5_f64.sin(), 0.0) * 2.0;
        let beside = |point: &Vector3<f64>| {
            let bearing_rad = point.y.atan2(point.x);
            (point - pole).norm() < 0.2 || (bearing_rad - 0.5).abs() < 0.1
        };
        assert!(features.sharp.points.iter().any(beside));
        for point in &features.flat.points {
            assert!((point.x.abs().max(point.y.abs()) - 4.0).abs() < 1e-9 || beside(point));
        }
        assert!(features.flat.points.len() <= 2 * SECTORS * FLAT);
        assert!(features.sharp.points.len() <= 2 * SECTORS * SHARP);
    }

    #[test]
    fn rings_are_found_again_in_the_cloud() {
        let features = features_of(&room());
        let (start, points) = features.planes.of_rings(1, 9);
        assert_eq!(start + points.len(), features.planes.points.len());
        assert_eq!(features.planes.ring_of(start), 1);
        assert_eq!(features.planes.ring_of(start - 1), 0);
        assert_eq!(features.planes.of_rings(0, 0).1.len(), start);
        assert!(Cloud::default().of_rings(0, 3).1.is_empty());
    }

    #[test]
    fn rings_too_short_for_a_curvature_give_no_features() {
        let mut sweep = room();
        sweep.returns.truncate(20);
        let features = features_of(&sweep);
        assert!(features.planes.points.is_empty() && features.sharp.points.is_empty());
    }
}
