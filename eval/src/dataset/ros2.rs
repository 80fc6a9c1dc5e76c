//! The ROS 2 messages that recordings hold, field by field as in their `.msg` files, which travel with every recording.
//!
//! Field names and meaning are ROS's own (common_interfaces, Jazzy); see the definition texts under `assets/msg`.

mod common;
mod geometry;
mod sensor;

pub(super) use common::{Header, Stamp, Text};
pub(super) use geometry::{
    MapMetaData, OccupancyGrid, Odometry, PoseMsg, PoseStamped, PoseWithCovariance, Quaternion, TfMessage,
    TransformStamped, TwistStamped, TwistWithCovariance,
};
pub(super) use sensor::{
    Imu, JointState, LaserScan, NavSatFix, NavSatStatus, PointCloud2, PointField, VelodynePacket,
    VelodyneScan,
};

use serde::{Serialize, de::DeserializeOwned};

/// A message type with what a recording must say of it.
pub(super) trait Message: Serialize + DeserializeOwned {
    /// Full ROS name.
    const TYPE: &'static str;
    /// Full concatenated `ros2msg` text, as rosbag2 writes it.
    const DEFINITION: &'static str;
    /// REP-2011 type hash.
    const HASH: &'static str;
}

macro_rules! message {
    ($message:ty, $type:literal, $file:literal, $hash:literal) => {
        impl Message for $message {
            const TYPE: &'static str = $type;
            const DEFINITION: &'static str = include_str!(concat!("../../assets/msg/", $file, ".msg"));
            const HASH: &'static str = concat!("RIHS01_", $hash);
        }
    };
}

message!(
    PointCloud2,
    "sensor_msgs/msg/PointCloud2",
    "PointCloud2",
    "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"
);
message!(
    LaserScan,
    "sensor_msgs/msg/LaserScan",
    "LaserScan",
    "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"
);
message!(
    Imu,
    "sensor_msgs/msg/Imu",
    "Imu",
    "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"
);
message!(
    NavSatFix,
    "sensor_msgs/msg/NavSatFix",
    "NavSatFix",
    "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"
);
message!(
    JointState,
    "sensor_msgs/msg/JointState",
    "JointState",
    "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
);
message!(
    Odometry,
    "nav_msgs/msg/Odometry",
    "Odometry",
    "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"
);
message!(
    OccupancyGrid,
    "nav_msgs/msg/OccupancyGrid",
    "OccupancyGrid",
    "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7"
);
message!(
    PoseStamped,
    "geometry_msgs/msg/PoseStamped",
    "PoseStamped",
    "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"
);
message!(
    TwistStamped,
    "geometry_msgs/msg/TwistStamped",
    "TwistStamped",
    "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"
);
message!(
    TfMessage,
    "tf2_msgs/msg/TFMessage",
    "TFMessage",
    "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
);
message!(
    Text,
    "std_msgs/msg/String",
    "String",
    "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
);
message!(
    VelodyneScan,
    "velodyne_msgs/msg/VelodyneScan",
    "VelodyneScan",
    "4e4edd7152e8bd604311d8b2e68e4c1b0771c8ce72700de79f6d1418aa242b3c"
);
