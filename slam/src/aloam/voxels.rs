//! Thinning of clouds: one mean point per voxel.

use nalgebra::Vector3;

/// Averages clouds by voxel; keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Thinner {
    keys: Vec<([i64; 3], u32)>,
}

impl Thinner {
    /// Appends to `thin` the mean of the points in every voxel of side `voxel_m`, in order of the voxels.
    pub(crate) fn thin(&mut self, points: &[Vector3<f64>], voxel_m: f64, thin: &mut Vec<Vector3<f64>>) {
        self.keys.clear();
        self.keys.extend((0..).zip(points).map(|(index, point)| {
            let key = [point.z, point.y, point.x].map(|along_m| (along_m / voxel_m).floor() as i64);
            (key, index)
        }));
        self.keys.sort_unstable();
        for voxel in self.keys.chunk_by(|a, b| a.0 == b.0) {
            let sum: Vector3<f64> = voxel.iter().map(|(_, index)| points[*index as usize]).sum();
            thin.push(sum / voxel.len() as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_voxel_leaves_the_mean_of_its_points() {
        let points = [[0.1, 0.1, 0.1], [-0.1, 0.1, 0.1], [0.3, 0.1, 0.1], [0.1, 0.9, 0.1]].map(Vector3::from);
        let mut thin = Vec::new();
        Thinner::default().thin(&points, 0.4, &mut thin);
        let wanted = [[-0.1, 0.1, 0.1], [0.2, 0.1, 0.1], [0.1, 0.9, 0.1]].map(Vector3::from);
        assert_eq!(thin.len(), 3);
        assert!(thin.iter().zip(&wanted).all(|(a, b)| (a - b).norm() < 1e-12));
    }
}
