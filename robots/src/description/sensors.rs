//! Which frames of a robot are its sensors': the names that their drivers and makers use.

use super::Robot;
use arborloop_base::Pose;

/// A sensor that a robot has a frame for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorFrame {
    /// The lidar.
    Lidar,
    /// The inertial sensor.
    Imu,
    /// The satellite receiver's antenna.
    Antenna,
}

impl SensorFrame {
    /// Names of such frames, the most usual first: velodyne and ouster drivers, REP-105's `imu_link` and `gps_link`, and
    /// those of makers' models.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            SensorFrame::Lidar => {
                &["velodyne", "os_sensor", "os_lidar", "lidar", "lidar_link", "laser", "laser_link"]
            }
            SensorFrame::Imu => &["imu_link", "imu", "trunk_imu", "imu_frame"],
            SensorFrame::Antenna => &["gps_link", "navsat_link", "gps", "gnss_link", "antenna"],
        }
    }
}

impl Robot {
    /// The link that is a sensor's frame, if there is one.
    pub fn sensor_link(&self, sensor: SensorFrame) -> Option<&str> {
        let known = |name: &&&str| self.links.iter().any(|link| link.name == **name);
        sensor.names().iter().find(known).copied()
    }

    /// A sensor's mount on the base, joints at zero; `None` where the robot has no frame for it.
    pub fn mount(&self, sensor: SensorFrame) -> Option<Pose> {
        self.frame(self.sensor_link(sensor)?)
    }
}
