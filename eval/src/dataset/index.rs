//! What a recording of MCAP files holds, and which of its topics say what a robot's sensors said.

use super::error::DatasetError;
use super::mcap_file::{self, Item, McapCursor, Topic};
use super::ros2::{Imu, LaserScan, Message, NavSatFix, Odometry, PointCloud2, VelodyneScan};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A topic's type and how many messages it has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) message_type: String,
    pub(super) messages: u64,
}

/// Topics of a recording by name.
#[derive(Debug, Clone, Default)]
pub(super) struct Index(pub(super) BTreeMap<String, Entry>);

/// The form in which sweeps come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LidarForm {
    Packets,
    Cloud,
    Scan,
}

/// The topics that observations are read from.
#[derive(Debug, Clone)]
pub(super) struct Topics {
    pub(super) lidar: String,
    pub(super) form: LidarForm,
    pub(super) imu: Option<String>,
    pub(super) fix: Option<String>,
    pub(super) odometry: Option<String>,
}

impl Index {
    /// From the summaries, or for files without one by reading them as far as they go.
    pub(super) fn of(files: &[PathBuf]) -> Result<Self, DatasetError> {
        let mut index = Index::default();
        for file in files {
            match mcap_file::summary(file) {
                Some(topics) => topics.iter().for_each(|(topic, messages)| index.add(topic, *messages)),
                None => index.scan(file)?,
            }
        }
        Ok(index)
    }

    /// An error counts only where nothing at all could be read before it; the reader meets the others in their place.
    fn scan(&mut self, file: &PathBuf) -> Result<(), DatasetError> {
        let mut cursor = McapCursor::new(std::slice::from_ref(file));
        let mut any = false;
        while let Some(item) = cursor.next() {
            match item {
                Ok(Item::Message { topic, .. }) => {
                    any = true;
                    self.add(&topic, 1);
                }
                Ok(Item::Metadata { .. }) => {}
                Err(error) if !any => return Err(error),
                Err(_) => break,
            }
        }
        Ok(())
    }

    fn add(&mut self, topic: &Topic, messages: u64) {
        let entry = self
            .0
            .entry(topic.name.clone())
            .or_insert_with(|| Entry { message_type: topic.message_type.clone(), messages: 0 });
        entry.messages += messages;
    }

    /// Messages of a topic.
    pub(super) fn messages(&self, topic: &str) -> u64 {
        self.0.get(topic).map_or(0, |entry| entry.messages)
    }

    /// Chooses the topics: packets before clouds before planar scans, our own names before others, and of the others
    /// the only one of its kind. Truth and estimates are never observations.
    pub(super) fn choose(&self, path: &Path) -> Result<Topics, DatasetError> {
        let forms = [
            (LidarForm::Packets, VelodyneScan::TYPE, &["/velodyne_packets"][..]),
            (
                LidarForm::Cloud,
                PointCloud2::TYPE,
                &["/velodyne_points", "/ouster/points", "/lidar/points"][..],
            ),
            (LidarForm::Scan, LaserScan::TYPE, &["/scan"][..]),
        ];
        for (form, message_type, usual) in forms {
            if let Some(lidar) = self.only(path, message_type, usual)? {
                return Ok(Topics {
                    lidar,
                    form,
                    imu: self.only(path, Imu::TYPE, &["/imu/data"]).ok().flatten(),
                    fix: self.only(path, NavSatFix::TYPE, &["/gps/fix"]).ok().flatten(),
                    // Another odometry may be some system's estimate: only the conventional name is believed.
                    odometry: self.named(Odometry::TYPE, "/odom"),
                });
            }
        }
        Err(DatasetError::whole(
            path,
            self.listing(),
            format!("a lidar topic: {}, {} or {}", VelodyneScan::TYPE, PointCloud2::TYPE, LaserScan::TYPE),
        ))
    }

    fn named(&self, message_type: &str, topic: &str) -> Option<String> {
        let entry = self.0.get(topic)?;
        (entry.message_type == message_type && entry.messages > 0).then(|| topic.to_owned())
    }

    fn only(&self, path: &Path, message_type: &str, usual: &[&str]) -> Result<Option<String>, DatasetError> {
        if let Some(topic) = usual.iter().find_map(|topic| self.named(message_type, topic)) {
            return Ok(Some(topic));
        }
        let others: Vec<&String> = self
            .0
            .iter()
            .filter(|(_, entry)| entry.message_type == message_type && entry.messages > 0)
            .map(|(topic, _)| topic)
            .filter(|topic| !topic.starts_with("/ground_truth/") && !topic.starts_with("/slam/"))
            .collect();
        match others.as_slice() {
            [] => Ok(None),
            [topic] => Ok(Some((*topic).clone())),
            _ => Err(DatasetError::whole(
                path,
                format!("several topics of {message_type}: {others:?}"),
                format!("one, or one named {}", usual.join(" or ")),
            )),
        }
    }

    /// The topics in words.
    pub(super) fn listing(&self) -> String {
        if self.0.values().all(|entry| entry.messages == 0) {
            return "a recording without messages".to_owned();
        }
        let topics: Vec<String> =
            self.0.iter().map(|(topic, entry)| format!("{topic} ({})", entry.message_type)).collect();
        format!("the topics {}", topics.join(", "))
    }
}
