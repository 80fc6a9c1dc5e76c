//! `aloam`: the baseline that the paper compares with. LOAM (Zhang and Singh 2014) in the form of the public A-LOAM, with
//! that program's parameters for a VLP-16.
//!
//! Its weaknesses are kept: features by curvature alone, so that leaves, grass and arcs of ground are as good as trunks;
//! six degrees of freedom from sixteen rings; no correction of the motion within a sweep, as the public program is
//! shipped; a map that never takes back what it drew; no loop closure. What is different is said where it is.

mod features;
mod mapping;
mod odometry;
mod registration;
pub(crate) mod settings;
mod voxels;

use crate::rig::Rig;
use arborloop_base::{Estimate, Health, Observation, Pose, Slam, Sweep, Time, interpolate};
use features::{Extractor, Features};
use mapping::Mapping;
use odometry::SweepOdometry;
use settings::AloamSettings;

/// Fewer pairs determine no motion: the public program then warns, and goes on.
const PAIRS_MIN: usize = 10;
/// After so many sweeps in a row without enough pairs the pose must not be used.
const LOST_AFTER: usize = 10;

/// The system; see the module.
pub(crate) struct Aloam {
    settings: AloamSettings,
    base_from_lidar: Pose,
    extractor: Extractor,
    features: Features,
    odometry: SweepOdometry,
    mapping: Mapping,
    end: Option<Time>,
    failures: usize,
}

impl Aloam {
    /// A system that has seen nothing; the settings are checked.
    pub(crate) fn new(settings: AloamSettings, rig: &Rig) -> Self {
        Aloam {
            settings,
            base_from_lidar: rig.base_from_lidar,
            extractor: Extractor::default(),
            features: Features::default(),
            odometry: SweepOdometry::default(),
            mapping: Mapping::default(),
            end: None,
            failures: 0,
        }
    }

    fn sweep(&mut self, sweep: &Sweep) -> Estimate {
        self.extractor.extract(sweep, &self.settings, &mut self.features);
        let odometry_pairs = self.odometry.follow(&self.features);
        // The public program drops sweeps from its mapping when it is too slow; here every sweep is mapped: its best case.
        let (map_from_lidar, map_pairs) =
            self.mapping.refine(&self.features, &self.odometry.first_from_now, &self.settings);
        let is_first = self.end.is_none();
        let determined = odometry_pairs >= PAIRS_MIN && map_pairs >= PAIRS_MIN;
        let seen = is_first && self.features.planes.points.len() >= PAIRS_MIN;
        self.failures = if determined || seen { 0 } else { self.failures + 1 };
        let health = match self.failures {
            0 => Health::Tracking,
            LOST_AFTER.. => Health::Lost,
            _ => Health::Degraded,
        };
        let map_from_end = map_from_lidar * self.since_middle(sweep);
        self.end = Some(sweep.end);
        let map_from_base = self.base_from_lidar * map_from_end * self.base_from_lidar.inverse();
        Estimate { stamp: sweep.end, map_from_base, covariance: None, health }
    }

    /// The motion from the instant of the matched pose to the sweep's end. Points that are taken as if met at once tell
    /// the pose at the middle of the sweep; the public program leaves its users to find out, which is half a sweep of
    /// walking. An estimate belongs to the end, so the odometry's last motion carries on for that half.
    fn since_middle(&self, sweep: &Sweep) -> Pose {
        let elapsed_s = self.end.map_or(0.0, |end| (sweep.end - end).seconds());
        let half_s = 0.5 * (sweep.end - sweep.start).seconds();
        if elapsed_s <= 0.0 || half_s <= 0.0 {
            return Pose::identity();
        }
        let share = (half_s / elapsed_s).min(1.0);
        interpolate(&Pose::identity(), &self.odometry.before_from_now, share)
    }
}

impl Slam for Aloam {
    fn observe(&mut self, observation: &Observation) -> Option<Estimate> {
        match observation {
            Observation::Sweep(sweep) => Some(self.sweep(sweep)),
            _ => None,
        }
    }
}
