//! Where truth meets estimate: association, alignment, metrics, map scores, data sets and the report.
//!
//! Nothing here knows a simulator or a system: two trajectories, two grids or a recording come in, numbers and pages
//! go out. Distances are meters, angles are degrees where a person reads them (`_deg`) and radians elsewhere (`_rad`).

mod align;
mod ape;
mod associate;
mod consistency;
pub mod dataset;
mod loop_closure;
mod map;
pub mod paper;
pub mod report;
mod rpe;
mod score;
mod stats;

pub use align::{Alignment, align};
pub use ape::{PoseRelation, ape};
pub use associate::{Pair, PoseTime, associate, resample};
pub use consistency::{Consistency, consistency};
pub use loop_closure::{LoopError, loop_error};
pub use map::{CellVerdict, MapScore, MapScoreSettings, compare_maps, score_map};
pub use rpe::{PairSpacing, rpe};
pub use score::{ErrorSample, Revised, Score, ScoreError, ScoreSettings, score};
pub use stats::{OverSeeds, Stats};
