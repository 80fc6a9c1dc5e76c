//! `geometry_msgs`, `nav_msgs` and `tf2_msgs`.

use super::common::{Header, Stamp};
use crate::dataset::cdr::array;
use arborloop_base::{Pose, Twist};
use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

/// `geometry_msgs/Vector3`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Vector3 {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
}

/// `geometry_msgs/Point`: the same three numbers on the wire.
pub(crate) type Point = Vector3;

/// `geometry_msgs/Quaternion`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Quaternion {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
    pub(crate) w: f64,
}

/// `geometry_msgs/Pose`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct PoseMsg {
    pub(crate) position: Point,
    pub(crate) orientation: Quaternion,
}

/// `geometry_msgs/PoseStamped`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PoseStamped {
    pub(crate) header: Header,
    pub(crate) pose: PoseMsg,
}

/// `geometry_msgs/PoseWithCovariance`: x, y, z, then rotation about x, y, z; row by row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PoseWithCovariance {
    pub(crate) pose: PoseMsg,
    #[serde(with = "array")]
    pub(crate) covariance: [f64; 36],
}

/// `geometry_msgs/Twist`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct TwistMsg {
    pub(crate) linear: Vector3,
    pub(crate) angular: Vector3,
}

/// `geometry_msgs/TwistStamped`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TwistStamped {
    pub(crate) header: Header,
    pub(crate) twist: TwistMsg,
}

/// `geometry_msgs/TwistWithCovariance`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TwistWithCovariance {
    pub(crate) twist: TwistMsg,
    #[serde(with = "array")]
    pub(crate) covariance: [f64; 36],
}

/// `nav_msgs/Odometry`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Odometry {
    pub(crate) header: Header,
    pub(crate) child_frame_id: String,
    pub(crate) pose: PoseWithCovariance,
    pub(crate) twist: TwistWithCovariance,
}

/// `nav_msgs/MapMetaData`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct MapMetaData {
    pub(crate) map_load_time: Stamp,
    pub(crate) resolution: f32,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) origin: PoseMsg,
}

/// `nav_msgs/OccupancyGrid`: -1 unknown, 0 free, 100 occupied; row by row from the lowest y.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct OccupancyGrid {
    pub(crate) header: Header,
    pub(crate) info: MapMetaData,
    pub(crate) data: Vec<i8>,
}

/// `geometry_msgs/Transform`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Transform {
    pub(crate) translation: Vector3,
    pub(crate) rotation: Quaternion,
}

/// `geometry_msgs/TransformStamped`: `parent_from_child`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TransformStamped {
    pub(crate) header: Header,
    pub(crate) child_frame_id: String,
    pub(crate) transform: Transform,
}

/// `tf2_msgs/TFMessage`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TfMessage {
    pub(crate) transforms: Vec<TransformStamped>,
}

impl From<nalgebra::Vector3<f64>> for Vector3 {
    fn from(v: nalgebra::Vector3<f64>) -> Self {
        Vector3 { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Vector3> for nalgebra::Vector3<f64> {
    fn from(v: Vector3) -> Self {
        nalgebra::Vector3::new(v.x, v.y, v.z)
    }
}

impl From<UnitQuaternion<f64>> for Quaternion {
    fn from(q: UnitQuaternion<f64>) -> Self {
        Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
    }
}

impl Quaternion {
    /// The rotation, or `None` for a quaternion of no length.
    pub(crate) fn rotation(self) -> Option<UnitQuaternion<f64>> {
        UnitQuaternion::try_new(nalgebra::Quaternion::new(self.w, self.x, self.y, self.z), 1e-9)
    }
}

impl From<&Pose> for PoseMsg {
    fn from(pose: &Pose) -> Self {
        PoseMsg { position: pose.translation.vector.into(), orientation: pose.rotation.into() }
    }
}

impl PoseMsg {
    /// The rigid transform, or `None` for a quaternion of no length.
    pub(crate) fn pose(&self) -> Option<Pose> {
        let translation = nalgebra::Vector3::from(self.position);
        Some(Pose::from_parts(translation.into(), self.orientation.rotation()?))
    }
}

impl From<&Pose> for Transform {
    fn from(pose: &Pose) -> Self {
        Transform { translation: pose.translation.vector.into(), rotation: pose.rotation.into() }
    }
}

impl Transform {
    /// The rigid transform, or `None` for a quaternion of no length.
    pub(crate) fn pose(&self) -> Option<Pose> {
        PoseMsg { position: self.translation, orientation: self.rotation }.pose()
    }
}

impl From<&Twist> for TwistMsg {
    fn from(twist: &Twist) -> Self {
        TwistMsg { linear: twist.linear_mps.into(), angular: twist.angular_radps.into() }
    }
}

impl From<TwistMsg> for Twist {
    fn from(twist: TwistMsg) -> Self {
        Twist { linear_mps: twist.linear.into(), angular_radps: twist.angular.into() }
    }
}
