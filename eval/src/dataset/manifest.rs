//! `manifest.json`: what a recording is, by whom it was made and how to recognize its content.

use super::PoseTime;
use super::bag::{Recorded, TopicSummary, hex};
use super::error::{DatasetError, Place};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;

/// The whole manifest; the same inputs give the same bytes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of arborloop.
    pub tool_version: String,
    /// Name of the recording.
    pub name: String,
    /// The one seed.
    pub seed: u64,
    /// SHA-256 of the resolved scenario's TOML.
    pub scenario_sha256: String,
    /// SHA-256 over topic, log time and payload of every message.
    pub content_sha256: String,
    /// The same over the labels of the returns; absent where none were recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labels_sha256: Option<String>,
    /// The instant of a sweep that stamped poses belong to.
    pub pose_time: PoseTime,
    /// First to last message, nanoseconds.
    pub duration_ns: i64,
    /// What each frame is.
    pub frames: BTreeMap<String, String>,
    /// The topics.
    pub topics: Vec<TopicSummary>,
    /// Units in words.
    pub units: String,
}

impl Manifest {
    /// The manifest of a finished recording of a scenario.
    pub fn new(name: &str, seed: u64, resolved_scenario: &str, recorded: &Recorded) -> Self {
        let has = |topic: &str| recorded.topics.iter().any(|summary| summary.topic == topic);
        let lidar_frame = if has("/ouster/points") {
            "os_sensor"
        } else if has("/lidar/points") {
            "lidar"
        } else {
            "velodyne"
        };
        let frames = [
            ("world", "the scenario's truth: east, north, up"),
            ("start", "the base at time zero; files under gt/ are written here"),
            ("map", "a system's own origin: the base at the end of its first sweep"),
            ("odom", "the origin of dead reckoning"),
            ("base_link", "the robot: x forward, y left, z up"),
            (lidar_frame, "the lidar; mounts are in /tf_static and calib.yaml"),
            ("imu_link", "the inertial unit"),
            ("gps_link", "the satellite antenna"),
        ];
        Manifest {
            tool_version: env!("CARGO_PKG_VERSION").to_owned(),
            name: name.to_owned(),
            seed,
            scenario_sha256: sha256_hex(resolved_scenario.as_bytes()),
            content_sha256: recorded.content_hash.clone(),
            labels_sha256: recorded.labels_hash.clone(),
            pose_time: PoseTime::SweepEnd,
            duration_ns: recorded.duration.nanos(),
            frames: frames.map(|(frame, meaning)| (frame.to_owned(), meaning.to_owned())).into(),
            topics: recorded.topics.clone(),
            units: "meters, radians, seconds, kilograms; stamps count from the start of the simulated clock, which \
                    reads 1 s when the run begins"
                .to_owned(),
        }
    }
}

/// SHA-256 of bytes in hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Writes `manifest.json` into a directory.
pub fn write_manifest(dir: &Path, manifest: &Manifest) -> Result<(), DatasetError> {
    let path = dir.join("manifest.json");
    let text = serde_json::to_string_pretty(manifest)
        .map_err(|error| DatasetError::whole(&path, error.to_string(), "a manifest that JSON can hold"))?;
    std::fs::write(&path, text + "\n").map_err(DatasetError::io(&path, "write"))
}

/// Reads the `manifest.json` of a directory.
pub fn read_manifest(dir: &Path) -> Result<Manifest, DatasetError> {
    let path = dir.join("manifest.json");
    let text = std::fs::read_to_string(&path).map_err(DatasetError::io(&path, "read"))?;
    serde_json::from_str(&text).map_err(|error| {
        DatasetError::content(&path, Place::Line(error.line()), error.to_string(), "a manifest of arborloop")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Span;

    #[test]
    fn a_manifest_goes_to_json_and_comes_back_and_a_broken_one_is_named() {
        let recorded = Recorded {
            content_hash: "00ff".to_owned(),
            labels_hash: Some("0f".to_owned()),
            messages: 3,
            duration: Span::from_millis(100),
            topics: vec![TopicSummary {
                topic: "/imu/data".to_owned(),
                message_type: "sensor_msgs/msg/Imu".to_owned(),
                messages: 3,
            }],
        };
        let manifest = Manifest::new("cones", 42, "schema = 1\n", &recorded);
        let dir = tempfile::tempdir().unwrap();
        write_manifest(dir.path(), &manifest).unwrap();
        assert_eq!(read_manifest(dir.path()).unwrap(), manifest);
        std::fs::write(dir.path().join("manifest.json"), "{\n\"seed\": -1").unwrap();
        let message = read_manifest(dir.path()).unwrap_err().to_string();
        assert!(message.contains("manifest.json:2: found "), "{message}");
    }

    #[test]
    fn the_hash_is_the_published_one() {
        // FIPS 180-2, appendix B.1.
        let published = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_hex(b"abc"), published);
    }
}
