//! Bins of bearing: what a layer keeps of a sweep.

use super::features::Feature;
use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

/// The mean of the nearest returns in one bin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bin {
    /// Level distance of the nearest, meters.
    pub(crate) nearest_m: f64,
    /// Sum of the places of those about as near, meters, flat base frame.
    pub(crate) sum: Vector2<f64>,
    /// Sum of their times after the middle of the sweep, seconds.
    pub(crate) after_s: f64,
    /// Their number.
    pub(crate) count: f64,
    /// Their lowest and highest bearing, radians.
    pub(crate) sides_rad: [f64; 2],
}

pub(crate) const EMPTY: Bin = Bin {
    nearest_m: f64::INFINITY,
    sum: Vector2::new(0.0, 0.0),
    after_s: 0.0,
    count: 0.0,
    sides_rad: [f64::INFINITY, f64::NEG_INFINITY],
};

impl Bin {
    /// Takes in a return.
    pub(crate) fn add(&mut self, feature: &Feature, bearing_rad: f64) {
        self.sum += feature.at;
        self.after_s += feature.after_s;
        self.count += 1.0;
        self.sides_rad = [self.sides_rad[0].min(bearing_rad), self.sides_rad[1].max(bearing_rad)];
    }

    /// The mean as a feature of a layer.
    pub(crate) fn feature(&self, layer: usize) -> Feature {
        Feature { at: self.sum / self.count, after_s: self.after_s / self.count, layer }
    }
}

/// Number of bins of about a width, radians, all around.
pub(crate) fn bins_of(bin_rad: f64) -> usize {
    (TAU / bin_rad).round().max(1.0) as usize
}

/// The bin of a bearing from -pi to pi.
pub(crate) fn bin_of(bearing_rad: f64, bins: usize) -> usize {
    (((bearing_rad + PI) / TAU * bins as f64) as usize).min(bins - 1)
}
