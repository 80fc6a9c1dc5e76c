//! `sensor_msgs` and `velodyne_msgs`.

use super::common::{Header, Stamp};
use super::geometry::{Quaternion, Vector3};
use crate::dataset::cdr::array;
use arborloop_base::vlp16::PACKET_BYTES;
use serde::{Deserialize, Serialize};

/// `sensor_msgs/PointField`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PointField {
    pub(crate) name: String,
    pub(crate) offset: u32,
    pub(crate) datatype: u8,
    pub(crate) count: u32,
}

/// `sensor_msgs/PointCloud2`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PointCloud2 {
    pub(crate) header: Header,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) fields: Vec<PointField>,
    pub(crate) is_bigendian: bool,
    pub(crate) point_step: u32,
    pub(crate) row_step: u32,
    #[serde(with = "serde_bytes")]
    pub(crate) data: Vec<u8>,
    pub(crate) is_dense: bool,
}

/// `sensor_msgs/LaserScan`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LaserScan {
    pub(crate) header: Header,
    pub(crate) angle_min: f32,
    pub(crate) angle_max: f32,
    pub(crate) angle_increment: f32,
    pub(crate) time_increment: f32,
    pub(crate) scan_time: f32,
    pub(crate) range_min: f32,
    pub(crate) range_max: f32,
    pub(crate) ranges: Vec<f32>,
    pub(crate) intensities: Vec<f32>,
}

/// `sensor_msgs/Imu`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Imu {
    pub(crate) header: Header,
    pub(crate) orientation: Quaternion,
    pub(crate) orientation_covariance: [f64; 9],
    pub(crate) angular_velocity: Vector3,
    pub(crate) angular_velocity_covariance: [f64; 9],
    pub(crate) linear_acceleration: Vector3,
    pub(crate) linear_acceleration_covariance: [f64; 9],
}

/// `sensor_msgs/NavSatStatus`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct NavSatStatus {
    pub(crate) status: i8,
    pub(crate) service: u16,
}

/// `sensor_msgs/NavSatFix`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct NavSatFix {
    pub(crate) header: Header,
    pub(crate) status: NavSatStatus,
    pub(crate) latitude: f64,
    pub(crate) longitude: f64,
    pub(crate) altitude: f64,
    pub(crate) position_covariance: [f64; 9],
    pub(crate) position_covariance_type: u8,
}

/// `sensor_msgs/JointState`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct JointState {
    pub(crate) header: Header,
    pub(crate) name: Vec<String>,
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) effort: Vec<f64>,
}

/// `velodyne_msgs/VelodynePacket`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct VelodynePacket {
    pub(crate) stamp: Stamp,
    #[serde(with = "array")]
    pub(crate) data: [u8; PACKET_BYTES],
}

/// `velodyne_msgs/VelodyneScan`: one turn of the sensor as it came over the wire.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct VelodyneScan {
    pub(crate) header: Header,
    pub(crate) packets: Vec<VelodynePacket>,
}
