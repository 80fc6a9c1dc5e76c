//! The map of `icp2d`: one mean point per layer and cell, and lines through neighboring ones.

use crate::kdtree::KdTree;
use nalgebra::{Vector2, Vector3};
use std::collections::BTreeMap;

/// Layers of heights lie so far apart in the tree that no neighbor is of another layer, meters.
const LAYER_M: f64 = 1e6;
/// Points are no farther from the map's origin than this, so that layers stay apart, meters.
const PLACE_M_MAX: f64 = 1e5;

/// Points of the map.
#[derive(Debug, Clone, Default)]
pub(crate) struct Points {
    cells: BTreeMap<(usize, i64, i64), (Vector2<f64>, f64)>,
    means: Vec<Vector3<f64>>,
    tree: KdTree,
}

impl Points {
    /// Adds points (layer and place) and makes neighbors known.
    pub(crate) fn add(&mut self, points: impl IntoIterator<Item = (usize, Vector2<f64>)>, cell_m: f64) {
        for (layer, at) in points {
            if at.amax() > PLACE_M_MAX {
                continue;
            }
            let cell = at.map(|along_m| (along_m / cell_m).floor() as i64);
            let (sum, count) = self.cells.entry((layer, cell.x, cell.y)).or_insert((Vector2::zeros(), 0.0));
            *sum += at;
            *count += 1.0;
        }
        self.means.clear();
        self.means
            .extend(self.cells.iter().map(|((layer, ..), (sum, count))| lifted(*layer, &(sum / *count))));
        self.tree.build(self.means.iter().copied());
    }

    /// Whether nothing was added yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// The line through the two nearest points of a layer, both within reach: a place on it and its unit normal.
    pub(crate) fn line(
        &self,
        layer: usize,
        at: &Vector2<f64>,
        reach_m: f64,
    ) -> Option<(Vector2<f64>, Vector2<f64>)> {
        let nearest = self.tree.nearest::<2>(&lifted(layer, at));
        let [(_, first), (farther_m2, second)] = nearest.all() else { return None };
        if *farther_m2 > reach_m * reach_m {
            return None;
        }
        let (a, b) = (self.means[*first as usize].xy(), self.means[*second as usize].xy());
        let along = (b - a).try_normalize(1e-9)?;
        Some((a, Vector2::new(-along.y, along.x)))
    }
}

fn lifted(layer: usize, at: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(at.x, at.y, layer as f64 * LAYER_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_goes_through_the_nearest_two_points_of_its_own_layer() {
        let mut points = Points::default();
        assert!(points.is_empty());
        let row = (0..5).map(|n| (0, Vector2::new(0.25 * f64::from(n) + 0.05, 1.05)));
        let other = (0..5).map(|n| (1, Vector2::new(0.55, 0.25 * f64::from(n) + 0.05)));
        points.add(row.chain(other), 0.1);
        let (place, normal) = points.line(0, &Vector2::new(0.5, 1.2), 0.5).unwrap();
        assert!((place.y - 1.05).abs() < 1e-12 && normal.x.abs() < 1e-12);
        let (place, normal) = points.line(1, &Vector2::new(0.5, 0.5), 0.5).unwrap();
        assert!((place.x - 0.55).abs() < 1e-12 && normal.y.abs() < 1e-12);
        assert_eq!(points.line(0, &Vector2::new(0.5, 3.0), 0.5), None);
        assert_eq!(points.line(2, &Vector2::new(0.5, 1.2), 0.5), None);
    }
}
