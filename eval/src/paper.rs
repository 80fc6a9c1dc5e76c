//! Rows that the paper published (its tables 1 to 3), to print beside ours.
//!
//! Two cautions, both checked in the authors' released code and data (RAL-UC/RoSA_SLAM). Its angles are not headings:
//! they are differences between the directions of motion of two tracks, in radians, although the tables say degrees;
//! compare them with [`Score::motion_direction_mean_rad`](crate::Score::motion_direction_mean_rad), never with
//! `heading_mean_deg`. And its Pullally runs were given a motion input made from the satellite reference.

use serde::{Deserialize, Serialize};

/// What must be said wherever the rows are shown.
pub const CAUTION: &str = "Published angles are differences between directions of motion, in radians (the paper's \
    tables say degrees): they compare with motion direction, not with heading. The published Pullally runs used a \
    motion input made from the RTK reference.";

/// A printed value and the half-width printed behind its plus-minus sign, where there is one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Published {
    /// The value as printed.
    pub value: f64,
    /// `1.96 std / sqrt(n)`, as the authors' code computes it.
    pub half_width: Option<f64>,
}

/// One method at one site. Units are meters for positions and, as computed, radians of direction of motion for angles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PublishedRow {
    /// Where.
    pub site: &'static str,
    /// Whose method.
    pub method: &'static str,
    /// Which table of the paper.
    pub table: &'static str,
    /// Mean position error, meters.
    pub position_mean_m: Option<Published>,
    /// Root mean square position error, meters.
    pub position_rms_m: Option<Published>,
    /// Mean difference of directions of motion, radians.
    pub motion_direction_mean_rad: Option<Published>,
    /// Root mean square of the same.
    pub motion_direction_rms_rad: Option<Published>,
    /// Mean difference of the changes of direction of motion, radians.
    pub motion_direction_increment_mean_rad: Option<Published>,
    /// Root mean square of the same.
    pub motion_direction_increment_rms_rad: Option<Published>,
    /// Mean position increment error, meters.
    pub position_increment_mean_m: Option<Published>,
    /// Root mean square of the same.
    pub position_increment_rms_m: Option<Published>,
    /// Error over path length, percent (the paper prints a share).
    pub error_ratio_percent: Option<Published>,
    /// Error of the last pose, meters.
    pub loop_m: Option<Published>,
}

/// The paper's map rows (table 2, cone field, its own method). The tolerance of the match is not stated there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PublishedMapRow {
    /// Mean map error, 1 cm cells.
    pub mean_map_error_cells: Published,
    /// Accuracy.
    pub accuracy_ratio: Published,
    /// F1 score.
    pub f1_ratio: Published,
    /// Precision.
    pub ppv_ratio: Published,
    /// Sensitivity.
    pub tpr_ratio: Published,
    /// Specificity.
    pub tnr_ratio: Published,
}

/// The cone field, 6 m x 2 m, five laps: the paper's method (table 1; increments from its text).
pub const CONE_FIELD: PublishedRow = PublishedRow {
    site: "cone field",
    method: "paper",
    table: "table 1",
    position_mean_m: about(0.08, 0.05),
    position_rms_m: about(0.10, 0.01),
    motion_direction_mean_rad: about(0.12, 0.14),
    motion_direction_rms_rad: about(0.21, 0.01),
    motion_direction_increment_mean_rad: None,
    motion_direction_increment_rms_rad: None,
    position_increment_mean_m: exactly(0.03),
    position_increment_rms_m: exactly(0.06),
    error_ratio_percent: None,
    loop_m: about(0.15, 0.01),
};

/// The cone field: A-LOAM as the authors ran it (table 1; increments from the paper's text).
pub const CONE_FIELD_ALOAM: PublishedRow = PublishedRow {
    method: "A-LOAM",
    position_mean_m: about(0.99, 0.78),
    position_rms_m: about(1.37, 0.12),
    motion_direction_mean_rad: about(0.83, 0.99),
    motion_direction_rms_rad: about(1.21, 0.63),
    position_increment_mean_m: exactly(0.04),
    position_increment_rms_m: exactly(0.05),
    loop_m: about(2.79, 0.02),
    ..CONE_FIELD
};

/// CitrusFarm, 865.3 m: the paper's method (table 3).
pub const CITRUS_FARM: PublishedRow = PublishedRow {
    site: "CitrusFarm",
    method: "paper",
    table: "table 3",
    position_mean_m: exactly(1.48),
    position_rms_m: exactly(1.83),
    motion_direction_mean_rad: exactly(0.06),
    motion_direction_rms_rad: exactly(0.09),
    motion_direction_increment_mean_rad: exactly(0.06),
    motion_direction_increment_rms_rad: exactly(0.10),
    position_increment_mean_m: exactly(0.05),
    position_increment_rms_m: exactly(0.06),
    error_ratio_percent: exactly(0.26),
    loop_m: exactly(2.5605),
};

/// CitrusFarm: A-LOAM (table 3).
pub const CITRUS_FARM_ALOAM: PublishedRow = PublishedRow {
    method: "A-LOAM",
    position_mean_m: exactly(0.31),
    position_rms_m: exactly(0.36),
    motion_direction_mean_rad: exactly(0.06),
    motion_direction_rms_rad: exactly(0.29),
    motion_direction_increment_mean_rad: exactly(0.08),
    motion_direction_increment_rms_rad: exactly(0.41),
    position_increment_mean_m: exactly(0.20),
    position_increment_rms_m: exactly(0.27),
    error_ratio_percent: exactly(0.05),
    loop_m: exactly(0.1042),
    ..CITRUS_FARM
};

/// Bacchus, a vineyard, 102.3 m: the paper's method (table 3).
pub const BACCHUS: PublishedRow = PublishedRow {
    site: "Bacchus",
    method: "paper",
    table: "table 3",
    position_mean_m: exactly(0.75),
    position_rms_m: exactly(0.84),
    motion_direction_mean_rad: exactly(0.10),
    motion_direction_rms_rad: exactly(0.21),
    motion_direction_increment_mean_rad: exactly(0.34),
    motion_direction_increment_rms_rad: exactly(0.78),
    position_increment_mean_m: exactly(0.14),
    position_increment_rms_m: exactly(0.18),
    error_ratio_percent: exactly(0.73),
    loop_m: exactly(0.9591),
};

/// Bacchus: A-LOAM (table 3).
pub const BACCHUS_ALOAM: PublishedRow = PublishedRow {
    method: "A-LOAM",
    position_mean_m: exactly(1.11),
    position_rms_m: exactly(1.26),
    motion_direction_mean_rad: exactly(1.13),
    motion_direction_rms_rad: exactly(2.48),
    motion_direction_increment_mean_rad: exactly(0.34),
    motion_direction_increment_rms_rad: exactly(1.00),
    position_increment_mean_m: exactly(0.22),
    position_increment_rms_m: exactly(0.60),
    error_ratio_percent: exactly(1.05),
    loop_m: exactly(1.1621),
    ..BACCHUS
};

/// Pullally, three runs of about 150 m: the paper's method (table 3).
pub const PULLALLY: PublishedRow = PublishedRow {
    site: "Pullally",
    method: "paper",
    table: "table 3",
    position_mean_m: about(0.35, 0.13),
    position_rms_m: about(0.37, 0.04),
    motion_direction_mean_rad: about(0.11, 0.12),
    motion_direction_rms_rad: about(0.18, 0.02),
    motion_direction_increment_mean_rad: about(0.23, 0.21),
    motion_direction_increment_rms_rad: about(0.29, 0.03),
    position_increment_mean_m: about(0.04, 0.04),
    position_increment_rms_m: about(0.05, 0.01),
    error_ratio_percent: about(0.1, 0.0),
    loop_m: about(0.25, 0.00),
};

/// Pullally: A-LOAM (table 3), compared index by index, not by time, with the reference.
pub const PULLALLY_ALOAM: PublishedRow = PublishedRow {
    method: "A-LOAM",
    position_mean_m: about(20.51, 20.72),
    position_rms_m: about(26.05, 4.18),
    motion_direction_mean_rad: about(3.09, 2.64),
    motion_direction_rms_rad: about(3.84, 0.11),
    motion_direction_increment_mean_rad: about(1.81, 1.66),
    motion_direction_increment_rms_rad: about(2.32, 0.08),
    position_increment_mean_m: about(0.05, 0.06),
    position_increment_rms_m: about(0.07, 0.01),
    error_ratio_percent: about(6.0, 1.0),
    loop_m: about(41.99, 0.01),
    ..PULLALLY
};

/// The map of the cone field (table 2).
pub const CONE_FIELD_MAP: PublishedMapRow = PublishedMapRow {
    mean_map_error_cells: Published { value: 0.28, half_width: Some(0.05) },
    accuracy_ratio: Published { value: 1.00, half_width: Some(0.01) },
    f1_ratio: Published { value: 0.86, half_width: Some(0.02) },
    ppv_ratio: Published { value: 0.92, half_width: Some(0.03) },
    tpr_ratio: Published { value: 0.80, half_width: Some(0.03) },
    tnr_ratio: Published { value: 1.00, half_width: Some(0.02) },
};

/// Every pose row.
pub const ROWS: [PublishedRow; 8] = [
    CONE_FIELD,
    CONE_FIELD_ALOAM,
    CITRUS_FARM,
    CITRUS_FARM_ALOAM,
    BACCHUS,
    BACCHUS_ALOAM,
    PULLALLY,
    PULLALLY_ALOAM,
];

/// The rows of one site, the paper's own method first; empty for a site that the paper does not have.
pub fn rows_of(site: &str) -> Vec<PublishedRow> {
    ROWS.iter().filter(|row| row.site == site).copied().collect()
}

const fn about(value: f64, half_width: f64) -> Option<Published> {
    Some(Published { value, half_width: Some(half_width) })
}

const fn exactly(value: f64) -> Option<Published> {
    Some(Published { value, half_width: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_site_has_the_papers_row_before_its_peer() {
        for site in ["cone field", "CitrusFarm", "Bacchus", "Pullally"] {
            let methods: Vec<_> = rows_of(site).iter().map(|row| row.method).collect();
            assert_eq!(methods, ["paper", "A-LOAM"], "{site}");
        }
        assert!(rows_of("moon").is_empty());
    }

    #[test]
    fn a_root_mean_square_is_never_below_its_mean() {
        for row in ROWS {
            let (mean, rms) = (row.position_mean_m.unwrap().value, row.position_rms_m.unwrap().value);
            assert!(rms >= mean, "{} {}", row.site, row.method);
        }
    }
}
