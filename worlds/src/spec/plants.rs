//! The tables that plantings of living plants share: rows, trunk, crown, leaves. Their defaults are each planting's own.

use super::table::{table, whole};
use super::{LEAVES_MAX, SpecError, at_most, error, within};
use crate::crown::{Crown, CrownShape};
use crate::leaf_angle::LeafAngle;
use crate::season::{Foliage, Season};
use arborloop_base::Draws;

whole!(CrownShape, LeafAngle, Season, Foliage);

/// Most rows, and most plants of a row: places are numbered `1000 row + plant`.
pub(crate) const ROW_MAX: usize = 999;
/// Most plants of a planting.
pub(crate) const PLANTS_MAX: usize = 10_000;

table! {
/// Parallel rows of plants. The rows of a bearing of 0 run east, and each next row lies north of the one before.
pub struct RowsSpec read as RowsText {
    /// How many rows.
    pub count: usize,
    /// Places of a row.
    pub plants: usize,
    /// From row to row, meters.
    pub spacing_m: f64,
    /// From plant to plant in a row, meters.
    pub plant_spacing_m: f64,
    /// Each plant stands up to this far from its place, along and across the row, meters.
    pub jitter_m: f64,
    /// Share of the places that are empty.
    pub missing_ratio: f64,
    /// Place of the first plant of the first row, world frame, meters.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// Bearing along which the rows run, degrees counter-clockwise from east.
    pub bearing_deg: f64,
}
}

table! {
/// Stems.
pub struct TrunkSpec read as TrunkText {
    /// Mean radius at the ground, meters; every plant's own comes from a log-normal law.
    pub radius_m: f64,
    /// Standard deviation of the radius as a share of its mean.
    pub radius_variation_ratio: f64,
    /// Height up to which the bare stem goes before it forks, meters.
    pub height_m: f64,
    /// Standard deviation of the lean along each axis, degrees.
    pub lean_deg: f64,
    /// Reflectance of bark near 905 nm.
    pub reflectivity_ratio: f64,
}
}

table! {
/// The space that a plant's leaves fill, and how its limbs share it.
pub struct CrownSpec read as CrownText {
    /// Its outline.
    pub shape: CrownShape,
    /// Height of its lower end above the ground, meters.
    pub base_m: f64,
    /// Height of its upper end above the ground, meters.
    pub height_m: f64,
    /// Size along the row, meters.
    pub length_m: f64,
    /// Size across the row, meters.
    pub width_m: f64,
    /// Every plant's size differs from the mean by up to this share.
    pub size_variation_ratio: f64,
    /// Every shape's proportions, girth and height, differ from the mean by up to this share.
    pub form_variation_ratio: f64,
    /// Limbs that move in the wind each for itself.
    pub limbs: usize,
    /// Clumps of leaves; their gaps are what light comes through.
    pub clumps: usize,
    /// Size of a clump as a share of the crown's.
    pub clump_ratio: f64,
    /// Share of the crown's size, from the middle, that has no clump's middle in it: 0 for a filled crown, 1 for a shell.
    pub hollow_ratio: f64,
}
}

table! {
/// Leaves in full leaf; the season changes their area and size.
pub struct LeavesSpec read as LeavesText {
    /// Mean side of a leaf, meters; each differs by up to a ninth.
    pub size_m: f64,
    /// One-sided leaf area per volume of the crown's outline, m2/m3 (leaf area density).
    pub area_per_m: f64,
    /// How they are inclined.
    pub angle: LeafAngle,
    /// Reflectance near 905 nm.
    pub reflectivity_ratio: f64,
}
}

impl RowsSpec {
    pub(crate) fn check(&self) -> Result<(), SpecError> {
        let table = "planting.rows";
        let at = |key, value, low, high| within(table, key, value, low, high);
        at_most(table, "count", self.count, ROW_MAX)?;
        at_most(table, "plants", self.plants, ROW_MAX)?;
        if self.count * self.plants > PLANTS_MAX {
            let wanted = format!("{} at most in {} rows", PLANTS_MAX / self.count, self.count);
            return Err(error(table, "plants", self.plants, wanted));
        }
        at("spacing_m", self.spacing_m, 0.5, 100.0)?;
        at("plant_spacing_m", self.plant_spacing_m, 0.1, 100.0)?;
        // Plants stay in order and in their row.
        at("jitter_m", self.jitter_m, 0.0, 0.45 * self.spacing_m.min(self.plant_spacing_m))?;
        at("missing_ratio", self.missing_ratio, 0.0, 1.0)?;
        at("x_m", self.x_m, -1000.0, 1000.0)?;
        at("y_m", self.y_m, -1000.0, 1000.0)?;
        at("bearing_deg", self.bearing_deg, -360.0, 360.0)
    }
}

impl TrunkSpec {
    /// Whether every value is in range and the stem ends below the crown's upper end.
    pub(crate) fn check(&self, crown: &Crown) -> Result<(), SpecError> {
        let at = |key, value, low, high| within("planting.trunk", key, value, low, high);
        at("radius_m", self.radius_m, 0.003, 2.0)?;
        at("radius_variation_ratio", self.radius_variation_ratio, 0.0, 1.0)?;
        at("height_m", self.height_m, 0.05, crown.top_m())?;
        at("lean_deg", self.lean_deg, 0.0, 20.0)?;
        at("reflectivity_ratio", self.reflectivity_ratio, 0.0, 1.0)
    }
}

impl CrownSpec {
    /// The mean crown in a season: its lower end stays, the rest is cut back.
    pub(crate) fn crown(&self, season: Season) -> Crown {
        self.formed(season, 1.0, 1.0)
    }

    /// The crown of one shape, with proportions of its own.
    pub(crate) fn crown_of_shape(&self, season: Season, draws: &mut Draws) -> Crown {
        let [girth_ratio, height_ratio] =
            [(); 2].map(|()| 1.0 + self.form_variation_ratio * draws.within(-1.0, 1.0));
        self.formed(season, girth_ratio, height_ratio)
    }

    fn formed(&self, season: Season, girth_ratio: f64, height_ratio: f64) -> Crown {
        let ratio = season.scales().crown_ratio;
        let height_m = ratio * height_ratio * (self.height_m - self.base_m);
        let girth_ratio = ratio * girth_ratio;
        Crown::standing(
            self.shape,
            self.base_m,
            height_m,
            girth_ratio * self.length_m,
            girth_ratio * self.width_m,
        )
    }

    pub(crate) fn check(&self, table: &str) -> Result<(), SpecError> {
        let at = |key, value, low, high| within(table, key, value, low, high);
        at("base_m", self.base_m, 0.0, 50.0)?;
        at("height_m", self.height_m, self.base_m + 0.1, 60.0)?;
        at("length_m", self.length_m, 0.1, 30.0)?;
        at("width_m", self.width_m, 0.1, 30.0)?;
        at("size_variation_ratio", self.size_variation_ratio, 0.0, 0.5)?;
        at("form_variation_ratio", self.form_variation_ratio, 0.0, 0.5)?;
        at("clump_ratio", self.clump_ratio, 0.05, 1.0)?;
        at("hollow_ratio", self.hollow_ratio, 0.0, 1.0)?;
        count(table, "limbs", self.limbs, 24)?;
        count(table, "clumps", self.clumps, 400)
    }
}

impl LeavesSpec {
    /// Whether every value is in range and a plant with this crown has leaves in numbers.
    pub(crate) fn check(&self, crown: &Crown) -> Result<(), SpecError> {
        let table = "planting.leaves";
        within(table, "size_m", self.size_m, 0.01, 0.5)?;
        within(table, "area_per_m", self.area_per_m, 0.0, 20.0)?;
        within(table, "reflectivity_ratio", self.reflectivity_ratio, 0.0, 1.0)?;
        numbered(table, "size_m", self.size_m, self.area_per_m, crown)
    }
}

/// Refuses leaves too small for a crown to be grown from.
pub(crate) fn numbered(
    table: &str,
    key: &str,
    size_m: f64,
    area_per_m: f64,
    crown: &Crown,
) -> Result<(), SpecError> {
    let area_m2 = area_per_m * crown.volume_m3();
    if area_m2 / size_m.powi(2) <= LEAVES_MAX {
        return Ok(());
    }
    let least_m = (area_m2 / LEAVES_MAX).sqrt();
    let wanted = format!("at least {least_m:.3}, so that a plant has {LEAVES_MAX} leaves or fewer");
    Err(error(table, key, size_m, wanted))
}

fn count(table: &str, key: &str, value: usize, most: usize) -> Result<(), SpecError> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err(error(table, key, value, format!("a number from 1 to {most}")))
}
