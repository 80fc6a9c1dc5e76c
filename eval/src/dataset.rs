//! Data sets: recordings written as rosbag2 directories and read back as observations, trajectories and maps on disk.
//!
//! A recording is an MCAP of ROS 2 messages (profile `ros2`, CDR), so that `ros2 bag`, kiss-icp, evo, rosbags and
//! Foxglove take it as it is. [`Recorder`] writes one, [`open`] reads one, ours or a stranger's. The promise is the
//! content hash (SHA-256 over topic, log time and payload), not the bytes of the file.

mod background;
mod bag;
mod calibration;
mod cdr;
mod cloud;
mod error;
mod geodesy;
mod ground_truth;
mod index;
mod manifest;
mod map;
mod mcap_file;
mod metadata;
mod observations;
mod ouster;
mod packets;
mod pullally;
mod readme;
mod recorder;
mod recording;
mod ros2;
mod scan;
mod states;
mod tum;

pub use crate::associate::PoseTime;
pub use background::BackgroundRecorder;
pub use bag::{Recorded, TopicSummary};
pub use calibration::write_calibration;
pub use error::{DatasetError, Place};
pub use geodesy::Datum;
pub use manifest::{Manifest, read_manifest, sha256_hex, write_manifest};
pub use map::{read_map, write_map};
pub use readme::write_readme;
pub use recorder::{CloudStamp, Recorder, RecorderSettings};
pub use recording::{Recording, RecordingKind, Reference, content_hash, open};
pub use tum::{read_tum, write_tum};

#[cfg(test)]
mod tests;
