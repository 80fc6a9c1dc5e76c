//! From a sweep to a view: the front end for one ring or for many.

use super::compact;
use super::features::View;
use super::hits::Hits;
use super::layers::Slicer;
use super::settings::MhdSettings;
use crate::rig::Rig;
use arborloop_base::Sweep;

/// Looks at sweeps; remembers the ground and keeps its memory.
pub(crate) struct FrontEnd {
    settings: MhdSettings,
    rig: Rig,
    hits: Hits,
    slicer: Slicer,
    is_planar: bool,
}

impl FrontEnd {
    /// The front end of `mhd` as it is by default.
    pub(crate) fn new(rig: &Rig) -> Self {
        FrontEnd::with(MhdSettings::default(), rig)
    }

    /// The front end of `mhd`; the settings are checked.
    pub(crate) fn with(settings: MhdSettings, rig: &Rig) -> Self {
        FrontEnd { settings, rig: *rig, hits: Hits::default(), slicer: Slicer::default(), is_planar: false }
    }

    /// Fills the view with the features of a sweep; `heading_rad` is about where the base heads in the map.
    pub(crate) fn look(&mut self, sweep: &Sweep, heading_rad: f64, view: &mut View) {
        view.clear();
        self.hits.read(sweep, &self.rig, self.settings.range_m_min);
        let lidar_m = self.rig.base_from_lidar.translation.vector;
        self.is_planar = sweep.rings <= 1;
        if self.is_planar {
            compact::view_of(&mut self.hits, lidar_m.xy(), &self.settings, view);
        } else {
            self.slicer.view_of(&self.hits, sweep.rings, lidar_m, heading_rad, &self.settings, view);
        }
    }

    /// Adds to the view what the beams of the sweep that was looked at last crossed without meeting anything.
    pub(crate) fn clear(&mut self, view: &mut View) {
        if self.is_planar {
            let lidar_m = self.rig.base_from_lidar.translation.vector.xy();
            compact::clear(&self.hits, lidar_m, &self.settings, view);
        } else {
            self.slicer.clear(&self.hits, &self.settings, view);
        }
    }
}
