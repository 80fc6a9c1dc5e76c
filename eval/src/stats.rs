//! Summaries of samples: evo's seven numbers over one run, and mean and spread over seeds.

use serde::{Deserialize, Serialize};

/// The statistics that evo prints, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    /// Number of samples.
    pub count: usize,
    /// Root of the mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median; the mean of the two in the middle when the count is even.
    pub median: f64,
    /// Standard deviation of the samples themselves (divided by the count, as numpy's default).
    pub std: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Sum of squares, in the unit's square.
    pub sse: f64,
}

impl Stats {
    /// Summary of some samples; `None` when there is none. A sample that is not finite makes the summary not finite.
    pub fn of(samples: &[f64]) -> Option<Self> {
        let count = samples.len();
        let mut sorted = samples.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let sse: f64 = samples.iter().map(|x| x * x).sum();
        let mean = samples.iter().sum::<f64>() / count as f64;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count as f64;
        let median = (sorted[(count - 1) / 2] + sorted[count / 2]) / 2.0;
        Some(Stats {
            count,
            rmse: (sse / count as f64).sqrt(),
            mean,
            median,
            std: variance.sqrt(),
            min,
            max,
            sse,
        })
    }
}

/// One metric over the seeds of a suite, in the metric's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OverSeeds {
    /// Number of seeds.
    pub seeds: usize,
    /// Mean over the seeds.
    pub mean: f64,
    /// Standard deviation expected of a further seed (divided by count - 1); `None` with one seed.
    pub std: Option<f64>,
    /// Best (smallest) seed.
    pub min: f64,
    /// Worst (largest) seed.
    pub max: f64,
}

impl OverSeeds {
    /// Summary of one value per seed; `None` when there is none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let stats = Stats::of(values)?;
        let seeds = stats.count;
        let std = (seeds > 1).then(|| stats.std * (seeds as f64 / (seeds as f64 - 1.0)).sqrt());
        Some(OverSeeds { seeds, mean: stats.mean, std, min: stats.min, max: stats.max })
    }
}

/// The root of the mean square of some samples; 0 for none.
pub(crate) fn rms(samples: &[f64]) -> f64 {
    Stats::of(samples).map_or(0.0, |stats| stats.rmse)
}

/// The mean of some samples; 0 for none.
pub(crate) fn mean(samples: &[f64]) -> f64 {
    Stats::of(samples).map_or(0.0, |stats| stats.mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_statistics_of_a_hand_made_sample_are_the_textbook_ones() {
        let stats = Stats::of(&[4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!((stats.count, stats.mean, stats.median, stats.min, stats.max), (4, 2.5, 2.5, 1.0, 4.0));
        assert_eq!((stats.sse, stats.rmse, stats.std), (30.0, 7.5_f64.sqrt(), 1.25_f64.sqrt()));
        assert_eq!(Stats::of(&[5.0, 1.0, 2.0]).unwrap().median, 2.0);
        assert_eq!(Stats::of(&[]), None);
    }

    #[test]
    fn mean_square_is_squared_mean_plus_variance() {
        let samples: Vec<f64> = (0..97).map(|n| (f64::from(n) * 0.7).sin() * 3.0 + 1.0).collect();
        let stats = Stats::of(&samples).unwrap();
        assert!((stats.rmse.powi(2) - stats.mean.powi(2) - stats.std.powi(2)).abs() < 1e-12);
    }

    #[test]
    fn the_spread_over_seeds_is_the_one_expected_of_a_further_seed() {
        let over = OverSeeds::of(&[1.0, 2.0, 3.0]).unwrap();
        assert_eq!((over.seeds, over.mean, over.min, over.max), (3, 2.0, 1.0, 3.0));
        assert!((over.std.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(OverSeeds::of(&[1.0]).unwrap().std, None);
        assert_eq!(OverSeeds::of(&[]), None);
    }
}
