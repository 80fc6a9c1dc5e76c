//! The numbers that tables print, in their order, each with the one that the paper published beside it.

use arborloop_eval::paper::{Published, PublishedMapRow, PublishedRow};
use arborloop_eval::{MapScore, Score};

/// One number of a score `S`, and its place in a published row `P`.
pub(crate) struct Metric<S, P> {
    /// With its unit.
    pub(crate) name: &'static str,
    /// Digits behind the point.
    pub(crate) decimals: usize,
    pub(crate) of: fn(&S) -> Option<f64>,
    pub(crate) published: fn(&P) -> Option<Published>,
}

/// Numbers of a trajectory.
pub(crate) const POSE: &[Metric<Score, PublishedRow>] = &[
    pose("position mean (m)", 4, |s| Some(s.position_mean_m), |p| p.position_mean_m),
    pose("position RMS (m)", 4, |s| Some(s.position_rms_m), |p| p.position_rms_m),
    pose("position max (m)", 4, |s| Some(s.position_max_m), |_| None),
    pose("heading mean (deg)", 3, |s| s.heading_mean_deg, |_| None),
    pose("heading RMS (deg)", 3, |s| s.heading_rms_deg, |_| None),
    pose("motion direction mean (rad)", 3, |s| s.motion_direction_mean_rad, |p| p.motion_direction_mean_rad),
    pose("motion direction RMS (rad)", 3, |s| s.motion_direction_rms_rad, |p| p.motion_direction_rms_rad),
    pose(
        "motion direction increment mean (rad)",
        3,
        |s| s.motion_direction_increment_mean_rad,
        |p| p.motion_direction_increment_mean_rad,
    ),
    pose(
        "motion direction increment RMS (rad)",
        3,
        |s| s.motion_direction_increment_rms_rad,
        |p| p.motion_direction_increment_rms_rad,
    ),
    pose(
        "position increment mean (m)",
        4,
        |s| Some(s.position_increment_mean_m),
        |p| p.position_increment_mean_m,
    ),
    pose(
        "position increment RMS (m)",
        4,
        |s| Some(s.position_increment_rms_m),
        |p| p.position_increment_rms_m,
    ),
    pose("heading increment mean (deg)", 3, |s| s.heading_increment_mean_deg, |_| None),
    pose("error of path length (%)", 4, |s| s.error_ratio_percent, |p| p.error_ratio_percent),
    pose("loop (m)", 4, |s| Some(s.loop_m), |p| p.loop_m),
    pose("APE RMSE (m)", 4, |s| Some(s.ape.rmse), |_| None),
    pose("ATE RMSE, SE(2) (m)", 4, |s| s.ape_se2.map(|stats| stats.rmse), |_| None),
    pose("RPE RMSE (m)", 4, |s| s.rpe_translation.map(|stats| stats.rmse), |_| None),
    pose("error over covariance, ANEES", 2, |s| s.consistency.map(|c| c.anees), |_| None),
    pose("outside of 95 % ellipsoid (%)", 1, |s| s.consistency.map(|c| c.outside_95_percent), |_| None),
    pose("confidently wrong poses", 0, |s| s.consistency.map(|c| c.confidently_wrong as f64), |_| None),
    pose("finally: position mean (m)", 4, |s| s.revised.map(|r| r.position_mean_m), |_| None),
    pose("finally: heading mean (deg)", 3, |s| s.revised.and_then(|r| r.heading_mean_deg), |_| None),
    pose("finally: loop (m)", 4, |s| s.revised.map(|r| r.loop_m), |_| None),
];

/// Numbers of a map.
pub(crate) const MAP: &[Metric<MapScore, PublishedMapRow>] = &[
    map("map error (cells)", 2, |m| m.mean_map_error_cells, |p| Some(p.mean_map_error_cells)),
    map("map accuracy", 3, |m| m.accuracy_ratio, |p| Some(p.accuracy_ratio)),
    map("map F1", 3, |m| m.f1_ratio, |p| Some(p.f1_ratio)),
    map("map PPV", 3, |m| m.ppv_ratio, |p| Some(p.ppv_ratio)),
    map("map TPR", 3, |m| m.tpr_ratio, |p| Some(p.tpr_ratio)),
    map("map TNR", 3, |m| m.tnr_ratio, |p| Some(p.tnr_ratio)),
];

/// A published number as the paper prints it.
pub(crate) fn as_printed(published: Published) -> String {
    match published.half_width {
        Some(half) => format!("{} +- {half}", published.value),
        None => published.value.to_string(),
    }
}

const fn pose(
    name: &'static str,
    decimals: usize,
    of: fn(&Score) -> Option<f64>,
    published: fn(&PublishedRow) -> Option<Published>,
) -> Metric<Score, PublishedRow> {
    Metric { name, decimals, of, published }
}

const fn map(
    name: &'static str,
    decimals: usize,
    of: fn(&MapScore) -> Option<f64>,
    published: fn(&PublishedMapRow) -> Option<Published>,
) -> Metric<MapScore, PublishedMapRow> {
    Metric { name, decimals, of, published }
}
