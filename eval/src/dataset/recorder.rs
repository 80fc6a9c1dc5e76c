//! The recorder: every record of a run becomes ROS messages in a rosbag2 directory, truth also becomes TUM files.

mod settings;

pub use settings::{CloudStamp, RecorderSettings};

use super::bag::{Bag, Moment, Recorded};
use super::error::{DatasetError, Refusal};
use super::ground_truth::TruthLog;
use super::ros2::{Header, Message, PointCloud2, Text, TfMessage, TransformStamped, TwistStamped};
use super::{cloud, metadata, ouster, packets, scan, states};
use arborloop_base::{
    Cell, Estimate, Grid, Health, Label, Observation, Odometry, Pose, Record, Sink, SinkError, Span, Sweep,
    Time, Truth, Twist, Wire,
};
use nalgebra::UnitQuaternion;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Name of the MCAP metadata record that marks a recording as ours: log times of sweeps are their ends.
pub(super) const MARK: &str = "arborloop";

pub(super) const BASE_FRAME: &str = "base_link";
const ODOM_FRAME: &str = "odom";
const MAP_FRAME: &str = "map";
const WORLD_FRAME: &str = "world";
const IMU_FRAME: &str = "imu_link";
const ANTENNA_FRAME: &str = "gps_link";
const LABELS_FOLDER: &str = "gt/labels";

/// Writes a rosbag2 directory. Dropping it unfinished still closes the files, so that an aborted run keeps what it had.
pub struct Recorder {
    dir: PathBuf,
    settings: RecorderSettings,
    bag: Bag,
    /// Labels are clouds too, and kiss-icp takes a recording without flags only when it has a single topic of clouds:
    /// they go into a recording of their own.
    labels: Option<Bag>,
    truth: TruthLog,
    reckoning: (Option<Time>, Pose),
    systems: BTreeMap<String, String>,
    mapper: Option<String>,
    mounted: bool,
    finished: bool,
}

impl Recorder {
    /// Makes the directory where it is missing and opens the MCAP in it.
    ///
    /// # Errors
    /// The MCAP exists already (nothing is ever overwritten), or the system refuses.
    pub fn create(dir: &Path, settings: RecorderSettings) -> Result<Recorder, DatasetError> {
        std::fs::create_dir_all(dir).map_err(DatasetError::io(dir, "create"))?;
        let path = dir.join(format!("{}_0.mcap", settings.name));
        let datum = &settings.datum;
        let mark = BTreeMap::from([
            ("name".to_owned(), settings.name.clone()),
            ("datum_latitude_deg".to_owned(), datum.latitude_deg.to_string()),
            ("datum_longitude_deg".to_owned(), datum.longitude_deg.to_string()),
            ("datum_altitude_m".to_owned(), datum.altitude_m.to_string()),
            ("pose_time".to_owned(), "sweep_end".to_owned()),
            ("cloud_stamp".to_owned(), settings.cloud_stamp.name().to_owned()),
        ]);
        let bag = Bag::create(&path, MARK, mark)?;
        Ok(Recorder {
            dir: dir.to_owned(),
            settings,
            bag,
            labels: None,
            truth: TruthLog::default(),
            reckoning: (None, Pose::identity()),
            systems: BTreeMap::new(),
            mapper: None,
            mounted: false,
            finished: false,
        })
    }

    /// Writes the true map of a height slice as `/ground_truth/map`, frame `world`.
    pub fn truth_map(&mut self, now: Time, map: &Grid<Cell>) -> Result<(), DatasetError> {
        let message = states::map_message(now, WORLD_FRAME, map);
        self.put(now, "/ground_truth/map", message)
    }

    /// Completes the MCAP and writes `metadata.yaml` and, where truth arrived, `gt/`.
    pub fn finish(mut self) -> Result<Recorded, DatasetError> {
        self.close()
    }

    fn close(&mut self) -> Result<Recorded, DatasetError> {
        self.finished = true;
        let mut recorded = close_bag(&self.dir, &mut self.bag)?;
        if let Some(labels) = &mut self.labels {
            recorded.labels_hash = Some(close_bag(&self.dir.join(LABELS_FOLDER), labels)?.content_hash);
        }
        self.truth.write(&self.dir, &self.settings.base_from_lidar)?;
        Ok(recorded)
    }

    /// The MCAP.
    pub(super) fn path(&self) -> &Path {
        self.bag.path()
    }

    /// Whether labels are written at all.
    pub(super) fn keeps_labels(&self) -> bool {
        self.settings.clouds
    }

    pub(super) fn record(&mut self, now: Time, record: &Record<'_>) -> Result<(), DatasetError> {
        if !self.mounted {
            self.mounted = true;
            let mounts = self.mounts(now);
            self.put(now, "/tf_static", mounts)?;
            if let Wire::Ouster(sensor) = &self.settings.wire {
                let message = Text { data: ouster::metadata(sensor) };
                self.put(now, "/ouster/metadata", Ok(message))?;
            }
        }
        match record {
            Record::Observation(Observation::Sweep(sweep)) => self.sweep(now, sweep),
            Record::Observation(Observation::Imu(imu)) => {
                self.put(now, "/imu/data", states::imu_message(imu, IMU_FRAME))
            }
            Record::Observation(Observation::Fix(fix)) => {
                let message = states::fix_message(fix, &self.settings.datum, ANTENNA_FRAME);
                self.put(now, "/gps/fix", message)
            }
            Record::Observation(Observation::Odometry(odometry)) => self.odometry(now, odometry),
            Record::Labels { sweep, labels } => self.labels(now, sweep, labels),
            Record::Estimate { system, estimate } => self.estimate(now, system, estimate),
            Record::Truth(truth) => self.ground_truth(now, truth),
            Record::Joints { names, angles_rad } => {
                self.put(now, "/joint_states", states::joints_message(now, names, angles_rad))
            }
            Record::Command(twist) => {
                let message = Header::new(now, BASE_FRAME)
                    .map(|header| TwistStamped { header, twist: (*twist).into() });
                self.put(now, "/cmd_vel", message)
            }
            Record::Map { system, map } => self.map(now, system, map),
        }
    }

    /// The mounts, once at the start.
    fn mounts(&self, now: Time) -> Result<TfMessage, Refusal> {
        let settings = &self.settings;
        let mounts = [
            (settings.lidar_frame.as_str(), &settings.base_from_lidar),
            (IMU_FRAME, &settings.base_from_imu),
            (ANTENNA_FRAME, &settings.base_from_antenna),
        ];
        let transforms = mounts.into_iter().map(|(child, base_from_child)| {
            Ok(TransformStamped {
                header: Header::new(now, BASE_FRAME)?,
                child_frame_id: child.to_owned(),
                transform: base_from_child.into(),
            })
        });
        Ok(TfMessage { transforms: transforms.collect::<Result<_, Refusal>>()? })
    }

    /// One of the messages of a sweep takes the exact instant: the cloud, for readers that stamp by log time. A planar
    /// sweep goes as a scan.
    fn sweep(&mut self, now: Time, sweep: &Sweep) -> Result<(), DatasetError> {
        self.truth.sweep(sweep);
        let frame = self.settings.lidar_frame.clone();
        let (clouds, packets) = (self.settings.clouds, self.settings.packets);
        if !clouds && !packets {
            return Ok(());
        }
        let mode = match &self.settings.wire {
            Wire::Ouster(sensor) => {
                let message = ouster::message_of(sensor, sweep, &frame);
                return self.put_at(now, "/ouster/points", Moment::Exact, message);
            }
            Wire::Plain => {
                let message = cloud::plain_message_of(sweep, &frame);
                return self.put_at(now, "/lidar/points", Moment::Exact, message);
            }
            Wire::Vlp16(_) if sweep.rings == 1 => {
                return self.put_at(now, "/scan", Moment::Exact, scan::message_of(sweep, &frame));
            }
            Wire::Vlp16(mode) => *mode,
        };
        if clouds {
            let message = cloud::message_of(sweep, self.cloud_stamp(sweep), &frame);
            self.put_at(now, "/velodyne_points", Moment::Exact, message)?;
        }
        if packets {
            let moment = if clouds { Moment::Beside } else { Moment::Exact };
            self.put_at(now, "/velodyne_packets", moment, packets::message_of(sweep, mode, &frame))?;
        }
        Ok(())
    }

    fn labels(&mut self, now: Time, sweep: &Sweep, labels: &[Label]) -> Result<(), DatasetError> {
        let planar = sweep.rings == 1 && matches!(self.settings.wire, Wire::Vlp16(_));
        if !self.settings.clouds || planar {
            return Ok(());
        }
        let message = self
            .labels_message(sweep, labels)
            .map_err(|refusal| refusal.recording(self.bag.path(), "labels"))?;
        let bag = match &mut self.labels {
            Some(bag) => bag,
            none => {
                let folder = self.dir.join(LABELS_FOLDER);
                std::fs::create_dir_all(&folder).map_err(DatasetError::io(&folder, "create"))?;
                let mark = BTreeMap::from([("labels_of".to_owned(), self.settings.name.clone())]);
                none.insert(Bag::create(&folder.join("labels_0.mcap"), MARK, mark)?)
            }
        };
        bag.write(now, "/ground_truth/labels", Moment::Exact, &message)
    }

    /// One point per point of the sweep's own cloud, in its order.
    fn labels_message(&self, sweep: &Sweep, labels: &[Label]) -> Result<PointCloud2, Refusal> {
        if labels.len() != sweep.returns.len() {
            return Err(Refusal::new(
                format!("{} labels for {} returns", labels.len(), sweep.returns.len()),
                "one label per return",
            ));
        }
        let frame = &self.settings.lidar_frame;
        let all = sweep.returns.iter().zip(labels);
        match &self.settings.wire {
            Wire::Vlp16(_) => {
                let hits = all.filter(|(one, _)| one.range_m.is_some());
                cloud::labels_of(hits, self.cloud_stamp(sweep), frame)
            }
            Wire::Ouster(sensor) => {
                let at = |index: usize| sweep.returns.get(index).zip(labels.get(index));
                cloud::labels_of(ouster::order(sensor).filter_map(at), sweep.start, frame)
            }
            Wire::Plain => cloud::labels_of(all, sweep.end, frame),
        }
    }

    fn cloud_stamp(&self, sweep: &Sweep) -> Time {
        match self.settings.cloud_stamp {
            CloudStamp::ScanEnd => sweep.end,
            CloudStamp::ScanStart => sweep.start,
        }
    }

    /// The pose of `/odom` is the dead reckoning of its twists from the first stamp on.
    fn odometry(&mut self, now: Time, odometry: &Odometry) -> Result<(), DatasetError> {
        let (before, pose) = &mut self.reckoning;
        if let Some(before) = *before {
            *pose *= moved(&odometry.twist, odometry.stamp - before);
        }
        *before = Some(odometry.stamp);
        let frames = (ODOM_FRAME, BASE_FRAME);
        let message = states::odometry_message(odometry.stamp, frames, pose, None, &odometry.twist);
        self.put(now, "/odom", message)
    }

    fn estimate(&mut self, now: Time, system: &str, estimate: &Estimate) -> Result<(), DatasetError> {
        let prefix = self.prefix(system)?;
        let (stamp, pose) = (estimate.stamp, &estimate.map_from_base);
        let health = match estimate.health {
            Health::Tracking => "tracking",
            Health::Degraded => "degraded",
            Health::Lost => "lost",
        };
        let frames = (MAP_FRAME, BASE_FRAME);
        let covariance = estimate.covariance.as_ref();
        let odometry = states::odometry_message(stamp, frames, pose, covariance, &Twist::default());
        self.put(now, &format!("{prefix}/pose"), states::pose_message(stamp, MAP_FRAME, pose))?;
        self.put(now, &format!("{prefix}/odom"), odometry)?;
        self.put(now, &format!("{prefix}/health"), Ok(Text { data: health.to_owned() }))
    }

    /// `/slam/<system>`, with `_` for every character that a ROS name cannot hold.
    fn prefix(&mut self, system: &str) -> Result<String, DatasetError> {
        let name: String = system.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let owner = self.systems.entry(name.clone()).or_insert_with(|| system.to_owned());
        if owner != system || name.is_empty() {
            return Err(DatasetError::Record {
                path: self.bag.path().to_owned(),
                what: "an estimate",
                found: format!("the systems `{owner}` and `{system}`, both /slam/{name}"),
                wanted: "names that differ in letters or digits".to_owned(),
            });
        }
        Ok(format!("/slam/{name}"))
    }

    fn ground_truth(&mut self, now: Time, truth: &Truth) -> Result<(), DatasetError> {
        if self.truth.contacts_differ(truth) {
            self.put(now, "/ground_truth/contacts", Ok(Text { data: contacts_text(truth) }))?;
        }
        if self.truth.truth(truth) {
            let (stamp, pose) = (truth.stamp, &truth.world_from_base);
            let frames = (WORLD_FRAME, BASE_FRAME);
            let odometry = states::odometry_message(stamp, frames, pose, None, &truth.twist);
            self.put(now, "/ground_truth/odom", odometry)?;
            self.put(now, "/ground_truth/pose", states::pose_message(stamp, WORLD_FRAME, pose))?;
        }
        Ok(())
    }

    /// The first system that draws a map has `/map`, every other one a topic of its own.
    fn map(&mut self, now: Time, system: &str, map: &Grid<Cell>) -> Result<(), DatasetError> {
        let mapper = self.mapper.get_or_insert_with(|| system.to_owned());
        let topic =
            if mapper == system { "/map".to_owned() } else { format!("{}/map", self.prefix(system)?) };
        self.put(now, &topic, states::map_message(now, MAP_FRAME, map))
    }

    fn put<M: Message>(
        &mut self,
        now: Time,
        topic: &str,
        message: Result<M, Refusal>,
    ) -> Result<(), DatasetError> {
        self.put_at(now, topic, Moment::Beside, message)
    }

    fn put_at<M: Message>(
        &mut self,
        now: Time,
        topic: &str,
        moment: Moment,
        message: Result<M, Refusal>,
    ) -> Result<(), DatasetError> {
        let message = message.map_err(|refusal| refusal.recording(self.bag.path(), M::TYPE))?;
        self.bag.write(now, topic, moment, &message)
    }
}

impl Sink for Recorder {
    fn write(&mut self, now: Time, record: &Record<'_>) -> Result<(), SinkError> {
        Ok(self.record(now, record)?)
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if !self.finished {
            // Nobody is left to tell; what reached the disk stays readable either way.
            let _ = self.close();
        }
    }
}

/// Completes an MCAP and writes the `metadata.yaml` beside it.
fn close_bag(dir: &Path, bag: &mut Bag) -> Result<Recorded, DatasetError> {
    let recorded = bag.finish()?;
    let path = dir.join(metadata::FILE_NAME);
    std::fs::write(&path, metadata::text(bag)).map_err(DatasetError::io(&path, "write"))?;
    Ok(recorded)
}

/// The motion of a body that keeps a twist in its own frame for a while: exact in attitude, and in position to the
/// second order (the chord of the arc, along the mean attitude).
pub(super) fn moved(twist: &Twist, span: Span) -> Pose {
    let turn = twist.angular_radps * span.seconds();
    let mean = UnitQuaternion::from_scaled_axis(turn * 0.5);
    Pose::from_parts(
        (mean * (twist.linear_mps * span.seconds())).into(),
        UnitQuaternion::from_scaled_axis(turn),
    )
}

/// `trunk touches cone 3; ...`, empty when nothing is touched.
fn contacts_text(truth: &Truth) -> String {
    let mut text = String::new();
    for contact in &truth.contacts {
        let separator = if text.is_empty() { "" } else { "; " };
        let class = format!("{:?}", contact.class).to_lowercase();
        // Writing to a string cannot fail.
        let _ = write!(text, "{separator}{} touches {class} {}", contact.part, contact.instance);
    }
    text
}
