//! Nearest points among fixed ones: a balanced k-d tree, stored in place.

use nalgebra::Vector3;

/// Ranges of no more points than this are looked through one by one.
const LEAF: usize = 8;

/// Points in space, sorted so that every range is split at its middle.
#[derive(Debug, Clone, Default)]
pub(crate) struct KdTree {
    /// The points and their index in the slice that was given.
    points: Vec<(Vector3<f64>, u32)>,
    /// Along which axis the range is split whose middle is here.
    axes: Vec<u8>,
}

/// Up to `K` neighbors, nearest first; of equally near ones the one that was given first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nearest<const K: usize> {
    /// Squared distance (meters^2) and index.
    found: [(f64, u32); K],
    count: usize,
}

impl KdTree {
    /// Sorts the points; all are finite.
    pub(crate) fn build(&mut self, points: impl IntoIterator<Item = Vector3<f64>>) {
        self.points.clear();
        self.points.extend((0..).zip(points).map(|(index, point)| (point, index)));
        self.axes.clear();
        self.axes.resize(self.points.len(), 0);
        split(&mut self.points, &mut self.axes);
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// The `K` points nearest to a place, fewer when there are not so many.
    pub(crate) fn nearest<const K: usize>(&self, at: &Vector3<f64>) -> Nearest<K> {
        let mut nearest = Nearest { found: [(f64::INFINITY, u32::MAX); K], count: 0 };
        self.look(0, self.points.len(), at, &mut nearest);
        nearest
    }

    fn look<const K: usize>(&self, low: usize, high: usize, at: &Vector3<f64>, nearest: &mut Nearest<K>) {
        if high - low <= LEAF {
            for (point, index) in &self.points[low..high] {
                nearest.offer((point - at).norm_squared(), *index);
            }
            return;
        }
        let middle = low + (high - low) / 2;
        let (point, index) = &self.points[middle];
        nearest.offer((point - at).norm_squared(), *index);
        let axis = usize::from(self.axes[middle]);
        let beyond_m = at[axis] - point[axis];
        let (near, far) = if beyond_m < 0.0 {
            ((low, middle), (middle + 1, high))
        } else {
            ((middle + 1, high), (low, middle))
        };
        self.look(near.0, near.1, at, nearest);
        if beyond_m * beyond_m <= nearest.limit_m2() {
            self.look(far.0, far.1, at, nearest);
        }
    }
}

impl<const K: usize> Nearest<K> {
    /// Squared distances (meters^2) and indices, nearest first.
    pub(crate) fn all(&self) -> &[(f64, u32)] {
        &self.found[..self.count]
    }

    fn limit_m2(&self) -> f64 {
        self.found[K - 1].0
    }

    fn offer(&mut self, square_m2: f64, index: u32) {
        let offered = (square_m2, index);
        if offered >= self.found[K - 1] {
            return;
        }
        let mut place = self.count.min(K - 1);
        while place > 0 && offered < self.found[place - 1] {
            self.found[place] = self.found[place - 1];
            place -= 1;
        }
        self.found[place] = offered;
        self.count = (self.count + 1).min(K);
    }
}

fn split(points: &mut [(Vector3<f64>, u32)], axes: &mut [u8]) {
    if points.len() <= LEAF {
        return;
    }
    let (mut low, mut high) = (points[0].0, points[0].0);
    for (point, _) in points.iter() {
        (low, high) = (low.inf(point), high.sup(point));
    }
    let axis = (high - low).imax();
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]));
    axes[middle] = axis as u8;
    let (points_below, points_above) = points.split_at_mut(middle);
    let (axes_below, axes_above) = axes.split_at_mut(middle);
    split(points_below, axes_below);
    split(&mut points_above[1..], &mut axes_above[1..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    #[test]
    fn the_nearest_are_those_of_a_look_at_every_point() {
        for n in [0_usize, 1, 4, 9, 30, 1000] {
            let mut draws = Seed(6).stream("tree").at(n as u64);
            // Places on a coarse lattice, so that many are equally near.
            let mut place = || Vector3::from_fn(|_, _| draws.within(-4.0, 4.0).round());
            let points: Vec<Vector3<f64>> = (0..n).map(|_| place()).collect();
            let mut tree = KdTree::default();
            tree.build(points.iter().copied());
            assert_eq!(tree.len(), n);
            for _ in 0..50 {
                let at = place();
                let mut slow: Vec<(f64, u32)> =
                    (0..).zip(&points).map(|(index, point)| ((point - at).norm_squared(), index)).collect();
                slow.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                slow.truncate(5);
                assert_eq!(tree.nearest::<5>(&at).all(), slow);
            }
        }
    }
}
