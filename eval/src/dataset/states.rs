//! The small messages: inertial, satellite and odometry observations, poses, joints, maps.

use super::error::Refusal;
use super::geodesy::Datum;
use super::ros2::{
    self, Header, JointState, MapMetaData, NavSatFix, NavSatStatus, OccupancyGrid, PoseMsg,
    PoseWithCovariance, Quaternion, Stamp, TwistWithCovariance,
};
use arborloop_base::{Cell, Fix, FixQuality, Grid, Imu, Odometry, Pose, Time, Twist};
use nalgebra::{Matrix3, Matrix6};

/// Inertial measurement without orientation: `orientation_covariance[0] = -1` (REP-145).
pub(super) fn imu_message(imu: &Imu, frame: &str) -> Result<ros2::Imu, Refusal> {
    let mut no_orientation = [0.0; 9];
    no_orientation[0] = -1.0;
    Ok(ros2::Imu {
        header: Header::new(imu.stamp, frame)?,
        orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
        orientation_covariance: no_orientation,
        angular_velocity: imu.rate_radps.into(),
        angular_velocity_covariance: [0.0; 9],
        linear_acceleration: imu.specific_force_mps2.into(),
        linear_acceleration_covariance: [0.0; 9],
    })
}

/// The measurement of an `Imu` message.
pub(super) fn imu_of(message: &ros2::Imu) -> Imu {
    Imu {
        stamp: message.header.stamp.time(),
        specific_force_mps2: message.linear_acceleration.into(),
        rate_radps: message.angular_velocity.into(),
    }
}

/// A satellite fix as latitude, longitude and height. ROS has no word for a float solution: it goes as
/// `STATUS_SBAS_FIX`, better than a single point and worse than `STATUS_GBAS_FIX`, which says fixed.
pub(super) fn fix_message(fix: &Fix, datum: &Datum, frame: &str) -> Result<NavSatFix, Refusal> {
    let point = datum.offset(&fix.position_m);
    let status = match fix.quality {
        FixQuality::None => -1,
        FixQuality::Single => 0,
        FixQuality::Float => 1,
        FixQuality::Fixed => 2,
    };
    let mut position_covariance = [0.0; 9];
    // Column by column and row by row are the same: a covariance is symmetric.
    position_covariance.copy_from_slice(fix.covariance_m2.as_slice());
    Ok(NavSatFix {
        header: Header::new(fix.stamp, frame)?,
        status: NavSatStatus { status, service: 1 },
        latitude: point.latitude_deg,
        longitude: point.longitude_deg,
        altitude: point.altitude_m,
        position_covariance,
        position_covariance_type: 3,
    })
}

/// The fix of a `NavSatFix` message, east-north-up from a datum. A covariance of unknown type is zero.
pub(super) fn fix_of(message: &NavSatFix, datum: &Datum) -> Fix {
    let point = datum_of(message);
    let known = message.position_covariance_type != 0;
    Fix {
        stamp: message.header.stamp.time(),
        position_m: datum.offset_to(&point),
        covariance_m2: if known {
            Matrix3::from_row_slice(&message.position_covariance)
        } else {
            Matrix3::zeros()
        },
        quality: match message.status.status {
            ..=-1 => FixQuality::None,
            0 => FixQuality::Single,
            1 => FixQuality::Float,
            2.. => FixQuality::Fixed,
        },
    }
}

/// The place of a fix, for a recording that names no datum of its own.
pub(super) fn datum_of(message: &NavSatFix) -> Datum {
    Datum { latitude_deg: message.latitude, longitude_deg: message.longitude, altitude_m: message.altitude }
}

/// A pose and the twist of the child frame at a stamp. A covariance that is not known is all zeros.
pub(super) fn odometry_message(
    stamp: Time,
    frames: (&str, &str),
    pose: &Pose,
    covariance: Option<&Matrix6<f64>>,
    twist: &Twist,
) -> Result<ros2::Odometry, Refusal> {
    let mut numbers = [0.0; 36];
    if let Some(covariance) = covariance {
        numbers.copy_from_slice(covariance.as_slice());
    }
    Ok(ros2::Odometry {
        header: Header::new(stamp, frames.0)?,
        child_frame_id: frames.1.to_owned(),
        pose: PoseWithCovariance { pose: pose.into(), covariance: numbers },
        twist: TwistWithCovariance { twist: twist.into(), covariance: [0.0; 36] },
    })
}

/// The twist of an `Odometry` message; its pose is an integral that the observation does not carry.
pub(super) fn odometry_of(message: &ros2::Odometry) -> Odometry {
    Odometry { stamp: message.header.stamp.time(), twist: message.twist.twist.into() }
}

/// A pose at a stamp.
pub(super) fn pose_message(stamp: Time, frame: &str, pose: &Pose) -> Result<ros2::PoseStamped, Refusal> {
    Ok(ros2::PoseStamped { header: Header::new(stamp, frame)?, pose: pose.into() })
}

/// Joint angles, radians.
pub(super) fn joints_message(
    stamp: Time,
    names: &[String],
    angles_rad: &[f64],
) -> Result<JointState, Refusal> {
    if names.len() != angles_rad.len() {
        return Err(Refusal::new(
            format!("{} names and {} angles", names.len(), angles_rad.len()),
            "one angle per joint",
        ));
    }
    Ok(JointState {
        header: Header::new(stamp, "")?,
        name: names.to_vec(),
        position: angles_rad.to_vec(),
        velocity: Vec::new(),
        effort: Vec::new(),
    })
}

/// A raster as an occupancy grid: -1 unknown, 0 free, 100 occupied.
pub(super) fn map_message(stamp: Time, frame: &str, map: &Grid<Cell>) -> Result<OccupancyGrid, Refusal> {
    let origin = Pose::translation(map.origin().x, map.origin().y, 0.0);
    let side = |cells: usize| {
        u32::try_from(cells).map_err(|_| Refusal::new(format!("{cells} cells in a row"), "at most 2^32 - 1"))
    };
    Ok(OccupancyGrid {
        header: Header::new(stamp, frame)?,
        info: MapMetaData {
            map_load_time: Stamp::of(stamp)?,
            resolution: map.resolution_m() as f32,
            width: side(map.columns())?,
            height: side(map.rows())?,
            origin: PoseMsg::from(&origin),
        },
        data: map
            .cells()
            .iter()
            .map(|cell| match cell {
                Cell::Unknown => -1,
                Cell::Free => 0,
                Cell::Occupied => 100,
            })
            .collect(),
    })
}
