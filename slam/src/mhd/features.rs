//! What the front end hands to the matcher: points of upright things, seen from above.

use nalgebra::Vector2;

/// One point that takes part in matching, in the flat base frame: origin at the base, x along its heading, level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Feature {
    /// Where it was met from the base's pose at that instant, meters.
    pub(crate) at: Vector2<f64>,
    /// When it was met, after the middle of the sweep, seconds.
    pub(crate) after_s: f64,
    /// Which layer of heights it belongs to.
    pub(crate) layer: usize,
}

/// A stretch that beams crossed without meeting anything, in the flat base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clearing {
    /// Where the stretch begins, meters.
    pub(crate) from: Vector2<f64>,
    /// Where it ends, meters.
    pub(crate) to: Vector2<f64>,
    /// When the beams fired, after the middle of the sweep, seconds.
    pub(crate) after_s: f64,
    /// Which layer of heights was crossed.
    pub(crate) layer: usize,
}

/// What one sweep says of the surroundings.
#[derive(Debug, Clone, Default)]
pub(crate) struct View {
    /// Points of upright, compact things; in order of layer and bearing.
    pub(crate) features: Vec<Feature>,
    /// Stretches seen empty.
    pub(crate) clearings: Vec<Clearing>,
}

impl View {
    /// Forgets the last sweep and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.features.clear();
        self.clearings.clear();
    }
}
