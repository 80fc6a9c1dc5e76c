//! What a recording is called and what goes into it.

use crate::dataset::geodesy::Datum;
use arborloop_base::{Pose, Wire};
use serde::{Deserialize, Serialize};

/// Which instant of a sweep the header of a cloud names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CloudStamp {
    /// The end, as the Velodyne driver does by default; point times are negative.
    #[default]
    ScanEnd,
    /// The start; point times are positive.
    ScanStart,
}

impl CloudStamp {
    /// The name in files.
    pub(super) fn name(self) -> &'static str {
        match self {
            CloudStamp::ScanEnd => "scan_end",
            CloudStamp::ScanStart => "scan_start",
        }
    }
}

/// What a recording is called and what goes into it.
#[derive(Debug, Clone, PartialEq)]
pub struct RecorderSettings {
    /// Name of the recording; the MCAP is `<name>_0.mcap`.
    pub name: String,
    /// Write sweeps as clouds, with labels: for data sets. Misses are lost.
    pub clouds: bool,
    /// Write sweeps as VLP-16 packets: compact and exact, misses kept, for runs. The cloud of any other lidar is exact
    /// itself and is written for data sets and runs alike.
    pub packets: bool,
    /// How the lidar speaks.
    pub wire: Wire,
    /// Where the lidar sits on the base.
    pub base_from_lidar: Pose,
    /// Where the inertial unit sits on the base.
    pub base_from_imu: Pose,
    /// Where the satellite antenna sits on the base.
    pub base_from_antenna: Pose,
    /// Frame name of the lidar, for instance `velodyne`.
    pub lidar_frame: String,
    /// Where on Earth the world's origin lies.
    pub datum: Datum,
    /// Which instant the headers of clouds name.
    pub cloud_stamp: CloudStamp,
}

impl Default for RecorderSettings {
    /// Packets only, everything mounted at the base's origin, on the equator.
    fn default() -> Self {
        RecorderSettings {
            name: "recording".to_owned(),
            clouds: false,
            packets: true,
            wire: Wire::default(),
            base_from_lidar: Pose::identity(),
            base_from_imu: Pose::identity(),
            base_from_antenna: Pose::identity(),
            lidar_frame: "velodyne".to_owned(),
            datum: Datum { latitude_deg: 0.0, longitude_deg: 0.0, altitude_m: 0.0 },
            cloud_stamp: CloudStamp::ScanEnd,
        }
    }
}
