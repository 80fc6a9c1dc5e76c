//! Rings ranked from the lowest beam up, whichever way the sensor counts them.

use arborloop_base::Sweep;

/// What the sweeps so far have shown of the sensor's beams.
#[derive(Debug, Default)]
pub(in super::super) struct Rings {
    count: u16,
    top_first: Option<bool>,
}

impl Rings {
    /// Sets `sweep.rings` and turns the ranks round where ring 0 is the highest beam (Ouster). `rows` is the height of
    /// an organized cloud, zero for others, whose beam count is the next of 16, 32, 64, 128 above what was seen.
    pub(super) fn rank(&mut self, sweep: &mut Sweep, rows: u32) {
        let seen = sweep.returns.iter().map(|one| one.ring).max().map_or(0, |ring| ring.saturating_add(1));
        let usual = [1, 16, 32, 64, 128].into_iter().find(|count| *count >= seen).unwrap_or(seen);
        let count = if rows > 0 { seen.max(rows.min(u32::from(u16::MAX)) as u16) } else { usual };
        self.count = self.count.max(count).max(1);
        if self.top_first.is_none() {
            self.top_first = slope(sweep).map(|slope| slope < 0.0);
        }
        sweep.rings = self.count;
        if self.top_first == Some(true) {
            for one in &mut sweep.returns {
                one.ring = (self.count - 1).saturating_sub(one.ring);
            }
        }
    }
}

/// Sign of the regression of elevation on ring; `None` while all returns are of one ring.
fn slope(sweep: &Sweep) -> Option<f64> {
    let count = sweep.returns.len() as f64;
    let mean_ring = sweep.returns.iter().map(|one| f64::from(one.ring)).sum::<f64>() / count;
    let mean_elevation = sweep.returns.iter().map(|one| one.elevation_rad).sum::<f64>() / count;
    let covariance: f64 = sweep
        .returns
        .iter()
        .map(|one| (f64::from(one.ring) - mean_ring) * (one.elevation_rad - mean_elevation))
        .sum();
    (covariance != 0.0 && covariance.is_finite()).then_some(covariance)
}
