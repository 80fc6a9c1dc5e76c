//! A recording opened for reading: rosbag2 directory, bare MCAP or the authors' Pullally file, told apart by content.

pub(super) mod front;

use super::bag::ContentHash;
use super::error::{DatasetError, Place};
use super::ground_truth;
use super::index::{Index, Topics};
use super::mcap_file::{Item, McapCursor};
use super::observations::{Observations, decode};
use super::pullally::Pullally;
use super::ros2::{PoseStamped, TwistStamped};
use super::{PoseTime, metadata, tum};
use arborloop_base::{Observation, Pose, Time, Trajectory, Twist};
use front::Front;
use std::collections::BTreeSet;
use std::io::Read;
use std::path::{Path, PathBuf};

const UNDERSTOOD: &str =
    "a rosbag2 directory with MCAP storage, an .mcap file, or a Pullally .npz with `scan0` and `time`";

/// Where our recorder puts sweeps.
const LIDAR_TOPICS: [&str; 5] =
    ["/velodyne_points", "/velodyne_packets", "/ouster/points", "/lidar/points", "/scan"];

/// What kind of recording it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordingKind {
    /// A rosbag2 directory with MCAP storage.
    Rosbag2,
    /// An MCAP file alone.
    Mcap,
    /// NumPy scans of the paper's orchard: planar, lidar only.
    Pullally,
}

/// A recording, opened and understood; its observations are still on disk.
#[derive(Debug)]
pub struct Recording {
    name: String,
    content: Content,
}

#[derive(Debug)]
enum Content {
    Mcap(Box<McapContent>),
    Pullally(Pullally),
}

#[derive(Debug)]
struct McapContent {
    path: PathBuf,
    dir: Option<PathBuf>,
    files: Vec<PathBuf>,
    index: Index,
    topics: Topics,
    front: Front,
}

/// Where the robot was, as a recording itself says.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Positions, and attitudes where `has_heading`.
    pub trajectory: Trajectory,
    /// Whether attitudes mean anything; without, fit the rotation before comparing.
    pub has_heading: bool,
    /// The instant of a sweep that each pose belongs to.
    pub pose_time: PoseTime,
}

/// Opens a recording: finds its sweeps, mounts and counts, checks that it is one.
///
/// # Errors
/// Nothing is there; it is empty, of no kind that is understood, without messages or without a lidar topic; a
/// Pullally file whose fields are not what they should be.
pub fn open(path: &Path) -> Result<Recording, DatasetError> {
    let name = path.file_stem().map_or("recording".to_owned(), |name| name.to_string_lossy().into_owned());
    if path.is_dir() {
        let files = metadata::files(path)?;
        // A directory's name may hold a dot of its own.
        let name = path.file_name().map_or(name, |name| name.to_string_lossy().into_owned());
        return open_mcap(path, Some(path), files, name);
    }
    let mut head = [0_u8; 16];
    let mut file = std::fs::File::open(path).map_err(DatasetError::io(path, "open"))?;
    let read = file.read(&mut head).map_err(DatasetError::io(path, "read"))?;
    match &head[..read] {
        [] => Err(DatasetError::whole(path, "an empty file", UNDERSTOOD)),
        [0x89, b'M', b'C', b'A', b'P', ..] => open_mcap(path, None, vec![path.to_owned()], name),
        [b'P', b'K', ..] => Ok(Recording { name, content: Content::Pullally(Pullally::read(path)?) }),
        [b'#', b'R', b'O', b'S', b'B', b'A', b'G', ..] => {
            Err(DatasetError::whole(path, "a ROS 1 bag (`rosbags-convert` makes a rosbag2)", UNDERSTOOD))
        }
        [b'S', b'Q', b'L', b'i', b't', b'e', ..] => {
            Err(DatasetError::whole(path, "an SQLite file (`ros2 bag convert` makes an MCAP)", UNDERSTOOD))
        }
        other => {
            let start: Vec<String> = other.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            Err(DatasetError::whole(path, format!("a file that starts with {}", start.join(" ")), UNDERSTOOD))
        }
    }
}

fn open_mcap(
    path: &Path,
    dir: Option<&Path>,
    files: Vec<PathBuf>,
    name: String,
) -> Result<Recording, DatasetError> {
    let index = Index::of(&files)?;
    let topics = index.choose(path)?;
    let front = Front::read(&files, &index, &topics)?;
    let name = front.name.clone().unwrap_or(name);
    let dir = dir.map(Path::to_owned);
    let content = McapContent { path: path.to_owned(), dir, files, index, topics, front };
    Ok(Recording { name, content: Content::Mcap(Box::new(content)) })
}

/// The content hash of an MCAP recording on disk, equal to what its recorder reported.
pub fn content_hash(path: &Path) -> Result<String, DatasetError> {
    let files = if path.is_dir() { metadata::files(path)? } else { vec![path.to_owned()] };
    let mut hash = ContentHash::default();
    let mut cursor = McapCursor::new(&files);
    while let Some(item) = cursor.next() {
        if let Item::Message { topic, log_time, payload } = item? {
            hash.add(&topic.name, log_time, &payload);
        }
    }
    Ok(hash.finish())
}

impl Recording {
    /// Its name: as the recorder called it, else that of the file or directory.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its kind.
    pub fn kind(&self) -> RecordingKind {
        match &self.content {
            Content::Mcap(content) if content.dir.is_some() => RecordingKind::Rosbag2,
            Content::Mcap(_) => RecordingKind::Mcap,
            Content::Pullally(_) => RecordingKind::Pullally,
        }
    }

    /// Where the lidar sits on the base, from `/tf_static`; the identity where the recording does not say.
    pub fn base_from_lidar(&self) -> Pose {
        match &self.content {
            Content::Mcap(content) => content.front.base_from_lidar,
            Content::Pullally(_) => Pose::identity(),
        }
    }

    /// How many sweeps it holds, for progress.
    pub fn sweeps(&self) -> Option<u64> {
        match &self.content {
            Content::Mcap(content) => Some(content.index.messages(&content.topics.lidar)),
            Content::Pullally(pullally) => Some(pullally.len() as u64),
        }
    }

    /// Its observations in the order of delivery, read as they are asked for. A message that does not decode, or the
    /// early end of a file that was cut off, is the last item.
    pub fn observations(
        &self,
    ) -> Result<Box<dyn Iterator<Item = Result<Observation, DatasetError>> + '_>, DatasetError> {
        match &self.content {
            Content::Mcap(content) => {
                let cursor = McapCursor::new(&content.files);
                let front = &content.front;
                Ok(Box::new(Observations::new(cursor, &content.topics, front)))
            }
            Content::Pullally(pullally) => Ok(Box::new(pullally.sweeps().map(Observation::Sweep).map(Ok))),
        }
    }

    /// What the robot obeyed at the end of each sweep, in order, from `/cmd_vel`; empty where nothing was recorded.
    ///
    /// # Errors
    /// A command that does not decode, or a file that was cut off.
    pub fn commands(&self) -> Result<Vec<(Time, Twist)>, DatasetError> {
        let Content::Mcap(content) = &self.content else { return Ok(Vec::new()) };
        let mut commands = Vec::new();
        let mut cursor = McapCursor::new(&content.files);
        while let Some(item) = cursor.next() {
            let Item::Message { topic, payload, .. } = item? else { continue };
            if topic.name == "/cmd_vel" {
                let index = commands.len() as u64;
                let message: TwistStamped = decode(&topic, &payload).map_err(|refusal| {
                    refusal.at(&content.path, Place::Message { topic: topic.name.clone(), index })
                })?;
                commands.push((message.header.stamp.time(), message.twist.into()));
            }
        }
        Ok(commands)
    }

    /// Where the robot was: of our own recordings the exact truth at sweep ends, of Pullally files the RTK positions;
    /// `None` for anyone else's.
    ///
    /// Truth comes from `gt/gt_base_link.tum` (frame `start`) or, in a bare MCAP and in a run that was killed, from
    /// `/ground_truth/pose` (frame `world`).
    pub fn reference(&self) -> Result<Option<Reference>, DatasetError> {
        match &self.content {
            Content::Mcap(content) => content.reference(),
            Content::Pullally(pullally) => Ok(pullally.reference()?.map(|trajectory| Reference {
                trajectory,
                has_heading: false,
                pose_time: PoseTime::Instant,
            })),
        }
    }
}

impl McapContent {
    fn reference(&self) -> Result<Option<Reference>, DatasetError> {
        let file = self.dir.as_ref().map(|dir| dir.join(ground_truth::FOLDER).join(ground_truth::BASE_FILE));
        let trajectory = match file.filter(|file| file.is_file()) {
            Some(file) => tum::read_tum(&file)?,
            None if self.front.ours && self.index.messages("/ground_truth/pose") > 0 => {
                self.recorded_truth()?
            }
            None => return Ok(None),
        };
        let found = Reference { trajectory, has_heading: true, pose_time: PoseTime::SweepEnd };
        Ok((!found.trajectory.is_empty()).then_some(found))
    }

    /// The recorded poses whose stamps are ends of sweeps. Damage ends the list; the observations report it.
    fn recorded_truth(&self) -> Result<Trajectory, DatasetError> {
        let mut ends = BTreeSet::new();
        let mut poses = Vec::new();
        let mut cursor = McapCursor::new(&self.files);
        while let Some(Ok(item)) = cursor.next() {
            let Item::Message { topic, log_time, payload } = item else { continue };
            // One topic of a sweep is logged at its very end, where it has several the others stand beside it.
            if LIDAR_TOPICS.contains(&topic.name.as_str()) {
                ends.insert(log_time as i64);
            } else if topic.name == "/ground_truth/pose"
                && let Ok(message) = decode::<PoseStamped>(&topic, &payload)
                && let Some(pose) = message.pose.pose()
            {
                poses.push((message.header.stamp.time(), pose));
            }
        }
        poses.retain(|(stamp, _)| ends.contains(&stamp.nanos()));
        Trajectory::new(poses).map_err(|error| {
            DatasetError::whole(&self.path, error.to_string(), "a trajectory in /ground_truth/pose")
        })
    }
}
