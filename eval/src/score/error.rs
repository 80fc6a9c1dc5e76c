//! Why two trajectories or two maps cannot be compared.

use crate::align::Alignment;
use crate::associate::PoseTime;
use arborloop_base::{Span, Time, TrajectoryError};

/// Why there is no score. Each message says what was found and what was wanted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScoreError {
    /// A trajectory is too short to be scored.
    #[error("the {which} has {found} poses; at least {wanted} are wanted")]
    TooFewPoses {
        /// `reference` or `estimate`.
        which: &'static str,
        /// Poses found.
        found: usize,
        /// Poses wanted.
        wanted: usize,
    },
    /// Too few poses meet.
    #[error(
        "only {found} pairs of poses lie within {association_max} of each other; at least {wanted} are wanted \
         (the nearest stamps of the two: the same clock, the same rate?)"
    )]
    TooFewPairs {
        /// Pairs found.
        found: usize,
        /// Pairs wanted.
        wanted: usize,
        /// The window.
        association_max: Span,
    },
    /// The two share no time at all.
    #[error(
        "reference and estimate share no time: the reference runs from {reference_from} to {reference_to} s, \
         the estimate from {estimate_from} to {estimate_to} s; do both count from the same zero?"
    )]
    NoOverlap {
        /// First stamp of the reference.
        reference_from: Time,
        /// Last stamp of the reference.
        reference_to: Time,
        /// First stamp of the estimate.
        estimate_from: Time,
        /// Last stamp of the estimate.
        estimate_to: Time,
    },
    /// They overlap, yet no stamp has a neighbor near enough.
    #[error(
        "no estimate lies within {association_max} of a reference pose, the nearest two are {nearest} apart; \
         widen the window or resample the reference at the estimate's stamps"
    )]
    StampsApart {
        /// Smallest distance in time of any two.
        nearest: Span,
        /// The window.
        association_max: Span,
    },
    /// The poses belong to different instants of the sweep.
    #[error(
        "the reference's poses hold at the {reference}, the estimate's at the {estimate}; \
         half a sweep is centimeters of walking: score against a reference at the same instant"
    )]
    PoseTimeMismatch {
        /// The reference's instant.
        reference: PoseTime,
        /// The estimate's instant.
        estimate: PoseTime,
    },
    /// The alignment needs headings that the reference does not have.
    #[error(
        "a reference without headings cannot be aligned by its {alignment}; take `origin_yaw`, `se2` or `se3`"
    )]
    HeadingNeeded {
        /// The alignment asked for.
        alignment: Alignment,
    },
    /// The positions leave the fitted rotation open.
    #[error("the alignment has no single answer for these positions; wanted: {wanted}")]
    Degenerate {
        /// What would do.
        wanted: &'static str,
    },
    /// A setting has no meaning.
    #[error("{name} is {found}; wanted: {wanted}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// Poses of a derived trajectory are out of order or not finite.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// The true map says nothing that a drawn map could be held against.
    #[error("the true map has no occupied cell among its {cells} cells; wanted at least one")]
    EmptyTruth {
        /// Cells of the true map.
        cells: usize,
    },
    /// The drawn map and the true map share no seen cell.
    #[error(
        "the map has {seen} seen cells, none of which lies where the true map is known; is `truth_from_map` right?"
    )]
    NoSharedCell {
        /// Cells that the drawn map calls free or occupied.
        seen: usize,
    },
    /// Comparing would need a raster too large to be meant.
    #[error(
        "comparing the maps needs a raster of {columns} x {rows} cells, more than {side_max} on a side or \
         {cells_max} in all; is `truth_from_map` or a resolution wrong?"
    )]
    RasterTooLarge {
        /// Columns needed.
        columns: u64,
        /// Rows needed.
        rows: u64,
        /// Longest side allowed, cells.
        side_max: u64,
        /// Largest number of cells allowed.
        cells_max: u64,
    },
}
