//! Exact Euclidean distance transform of a raster (Felzenszwalb and Huttenlocher 2012, "Distance Transforms of
//! Sampled Functions"): lower envelopes of parabolas, columns first, then rows.

/// Squared distance from each cell's center to the nearest marked cell's center, in cells; `None` without any mark.
/// Cells are row by row, `columns` to a row.
pub(super) fn squared_distances(marked: &[bool], columns: usize) -> Option<Vec<u32>> {
    if columns == 0 || !marked.contains(&true) {
        return None;
    }
    let rows = marked.len() / columns;
    let mut squared = vec![FAR; marked.len()];
    let mut envelope = Envelope::for_length(columns.max(rows));
    for column in 0..columns {
        envelope.clear();
        for row in 0..rows {
            if marked[row * columns + column] {
                envelope.add(row, 0);
            }
        }
        envelope.read(rows, |row, value| squared[row * columns + column] = value);
    }
    for row in squared.chunks_exact_mut(columns) {
        envelope.clear();
        for (column, value) in row.iter().enumerate() {
            if *value != FAR {
                envelope.add(column, *value);
            }
        }
        envelope.read(columns, |column, value| row[column] = value);
    }
    Some(squared)
}

/// Larger than any squared distance in a raster that fits in memory; stands for "no mark in this column".
const FAR: u32 = u32::MAX;

/// The lower envelope of parabolas `height + (x - vertex)^2`.
struct Envelope {
    vertex: Vec<usize>,
    height: Vec<u32>,
    /// Where each parabola takes over from the one before.
    from: Vec<f64>,
}

impl Envelope {
    fn for_length(length: usize) -> Self {
        let (vertex, height, from) =
            (Vec::with_capacity(length), Vec::with_capacity(length), Vec::with_capacity(length));
        Envelope { vertex, height, from }
    }

    fn clear(&mut self) {
        self.vertex.clear();
        self.height.clear();
        self.from.clear();
    }

    /// Adds the next parabola; vertices increase.
    fn add(&mut self, vertex: usize, height: u32) {
        let lifted = |vertex: usize, height: u32| f64::from(height) + (vertex * vertex) as f64;
        while let (Some(&v), Some(&h), Some(&from)) =
            (self.vertex.last(), self.height.last(), self.from.last())
        {
            let crossing = (lifted(vertex, height) - lifted(v, h)) / (2.0 * (vertex as f64 - v as f64));
            if crossing > from {
                self.push(vertex, height, crossing);
                return;
            }
            self.vertex.pop();
            self.height.pop();
            self.from.pop();
        }
        self.push(vertex, height, f64::NEG_INFINITY);
    }

    fn push(&mut self, vertex: usize, height: u32, from: f64) {
        self.vertex.push(vertex);
        self.height.push(height);
        self.from.push(from);
    }

    /// Hands the envelope's value at 0, 1, .. `length - 1` to `write`; nothing without a parabola.
    fn read(&self, length: usize, mut write: impl FnMut(usize, u32)) {
        let mut current = 0;
        for x in 0..length {
            while self.from.get(current + 1).is_some_and(|from| *from < x as f64) {
                current += 1;
            }
            if let (Some(vertex), Some(height)) = (self.vertex.get(current), self.height.get(current)) {
                let across = x.abs_diff(*vertex) as u32;
                write(x, height + across * across);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    fn brute_force(marked: &[bool], columns: usize) -> Vec<u32> {
        let place = |index: usize| ((index % columns) as i64, (index / columns) as i64);
        (0..marked.len())
            .map(|cell| {
                let (x, y) = place(cell);
                let squared =
                    |other: usize| ((x - place(other).0).pow(2) + (y - place(other).1).pow(2)) as u32;
                (0..marked.len()).filter(|other| marked[*other]).map(squared).min().unwrap()
            })
            .collect()
    }

    #[test]
    fn the_transform_equals_the_search_over_all_marks() {
        let stream = Seed(5).stream("distance");
        for round in 0..200 {
            let mut draws = stream.at(round);
            let (columns, rows) = (draws.within(1.0, 25.0) as usize, draws.within(1.0, 25.0) as usize);
            let share = [0.005, 0.05, 0.5][round as usize % 3];
            let mut marked: Vec<bool> = (0..columns * rows).map(|_| draws.chance(share)).collect();
            let somewhere = draws.within(0.0, marked.len() as f64) as usize;
            marked[somewhere] = true;
            assert_eq!(
                squared_distances(&marked, columns).unwrap(),
                brute_force(&marked, columns),
                "round {round}"
            );
        }
    }

    #[test]
    fn without_a_mark_there_is_no_distance() {
        assert_eq!(squared_distances(&[false; 6], 3), None);
        assert_eq!(squared_distances(&[], 0), None);
    }
}
