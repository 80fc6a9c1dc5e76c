//! What must be known of an MCAP recording before its first sweep: our own mark, the datum, where the lidar sits.

use crate::dataset::error::DatasetError;
use crate::dataset::geodesy::Datum;
use crate::dataset::index::{Index, LidarForm, Topics};
use crate::dataset::mcap_file::{Item, McapCursor, Topic};
use crate::dataset::observations::decode;
use crate::dataset::ouster;
use crate::dataset::recorder::{BASE_FRAME, MARK};
use crate::dataset::ros2::{LaserScan, PointCloud2, Text, TfMessage, VelodyneScan};
use arborloop_base::Pose;
use arborloop_base::os1::Os1;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::PathBuf;

/// Where an Ouster sensor says what it is.
const OUSTER_METADATA: &str = "/ouster/metadata";

/// The front of a recording.
#[derive(Debug, Default)]
pub(in super::super) struct Front {
    /// Whether our recorder wrote it: log times of sweeps are their ends.
    pub(in super::super) ours: bool,
    /// The name that the recorder gave.
    pub(super) name: Option<String>,
    /// The datum that the recorder gave.
    pub(in super::super) datum: Option<Datum>,
    /// Where the lidar sits; the identity where nothing says.
    pub(super) base_from_lidar: Pose,
    /// The Ouster sensor that our recorder says it recorded.
    pub(in super::super) ouster: Option<Os1>,
}

impl Front {
    /// Reads until the lidar's frame and the static transforms are known. What does not decode is left to the
    /// observations to report.
    pub(super) fn read(files: &[PathBuf], index: &Index, topics: &Topics) -> Result<Self, DatasetError> {
        let mut front = Front::default();
        let mut edges = BTreeMap::new();
        let mut frame = None;
        let mut transforms_left = index.messages("/tf_static");
        let mut metadata_left = index.messages(OUSTER_METADATA);
        let mut cursor = McapCursor::new(files);
        while frame.is_none() || transforms_left > 0 || metadata_left > 0 {
            let Some(Ok(item)) = cursor.next() else { break };
            match item {
                Item::Metadata { name, entries } if name == MARK => front.mark(&entries),
                Item::Metadata { .. } => {}
                Item::Message { topic, payload, .. } if topic.name == "/tf_static" => {
                    transforms_left = transforms_left.saturating_sub(1);
                    add_edges(&mut edges, &topic, &payload);
                }
                Item::Message { topic, payload, .. } if topic.name == OUSTER_METADATA => {
                    metadata_left = metadata_left.saturating_sub(1);
                    let text = decode::<Text>(&topic, &payload).ok();
                    front.ouster = text.and_then(|text| ouster::sensor_of(&text.data)).or(front.ouster);
                }
                Item::Message { topic, payload, .. } if frame.is_none() && topic.name == topics.lidar => {
                    frame = Some(frame_of(topics.form, &topic, &payload).unwrap_or_default());
                }
                Item::Message { .. } => {}
            }
        }
        front.base_from_lidar = chain(&edges, BASE_FRAME, &frame.unwrap_or_default()).unwrap_or_default();
        Ok(front)
    }

    fn mark(&mut self, entries: &BTreeMap<String, String>) {
        let number = |key: &str| entries.get(key)?.parse().ok().filter(|number: &f64| number.is_finite());
        self.ours = true;
        self.name = entries.get("name").cloned();
        self.datum = number("datum_latitude_deg")
            .zip(number("datum_longitude_deg"))
            .zip(number("datum_altitude_m"))
            .map(|((latitude_deg, longitude_deg), altitude_m)| Datum {
                latitude_deg,
                longitude_deg,
                altitude_m,
            });
    }
}

/// `parent_from_child` by (parent, child), both ways.
type Edges = BTreeMap<(String, String), Pose>;

fn add_edges(edges: &mut Edges, topic: &Topic, payload: &[u8]) {
    let Ok(message) = decode::<TfMessage>(topic, payload) else { return };
    for transform in message.transforms {
        let Some(parent_from_child) = transform.transform.pose() else { continue };
        let plain = |frame: &str| frame.trim_start_matches('/').to_owned();
        let (parent, child) = (plain(&transform.header.frame_id), plain(&transform.child_frame_id));
        edges.insert((child.clone(), parent.clone()), parent_from_child.inverse());
        edges.insert((parent, child), parent_from_child);
    }
}

fn frame_of(form: LidarForm, topic: &Topic, payload: &[u8]) -> Option<String> {
    let header = match form {
        LidarForm::Packets => decode::<VelodyneScan>(topic, payload).ok()?.header,
        LidarForm::Cloud => decode::<PointCloud2>(topic, payload).ok()?.header,
        LidarForm::Scan => decode::<LaserScan>(topic, payload).ok()?.header,
    };
    Some(header.frame_id.trim_start_matches('/').to_owned())
}

/// `to_from_from` along the shortest chain of transforms.
fn chain(edges: &Edges, to: &str, from: &str) -> Option<Pose> {
    let mut seen = BTreeSet::from([to.to_owned()]);
    let mut frontier = VecDeque::from([(to.to_owned(), Pose::identity())]);
    while let Some((frame, to_from_frame)) = frontier.pop_front() {
        if frame == from {
            return Some(to_from_frame);
        }
        for ((parent, child), parent_from_child) in edges {
            if *parent == frame && seen.insert(child.clone()) {
                frontier.push_back((child.clone(), to_from_frame * parent_from_child));
            }
        }
    }
    None
}
