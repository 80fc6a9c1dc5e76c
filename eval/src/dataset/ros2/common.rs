//! `std_msgs` and `builtin_interfaces`.

use crate::dataset::error::Refusal;
use arborloop_base::Time;
use serde::{Deserialize, Serialize};

const NANOS: i64 = 1_000_000_000;

/// `builtin_interfaces/Time`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct Stamp {
    pub(crate) sec: i32,
    pub(crate) nanosec: u32,
}

impl Stamp {
    /// The stamp of an instant; ROS stamps end in January 2038.
    pub(crate) fn of(time: Time) -> Result<Self, Refusal> {
        let (sec, nanosec) = (time.nanos().div_euclid(NANOS), time.nanos().rem_euclid(NANOS));
        let sec = i32::try_from(sec)
            .map_err(|_| Refusal::new(format!("stamp {time}"), "a stamp whose seconds fit 32 bits"))?;
        Ok(Stamp { sec, nanosec: nanosec as u32 })
    }

    /// The instant.
    pub(crate) fn time(self) -> Time {
        Time::from_nanos(i64::from(self.sec) * NANOS + i64::from(self.nanosec))
    }
}

/// `std_msgs/Header`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct Header {
    pub(crate) stamp: Stamp,
    pub(crate) frame_id: String,
}

impl Header {
    /// A header at an instant in a frame.
    pub(crate) fn new(time: Time, frame_id: &str) -> Result<Self, Refusal> {
        Ok(Header { stamp: Stamp::of(time)?, frame_id: frame_id.to_owned() })
    }
}

/// `std_msgs/String`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct Text {
    pub(crate) data: String,
}
