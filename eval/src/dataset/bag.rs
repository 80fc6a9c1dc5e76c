//! The MCAP of a recording as it is written: channels, log times, content hash. What the messages mean is not known here.
//!
//! Log times strictly increase and are unique. Messages of one instant are held back until the instant is over: the
//! one that completes at it (a sweep) gets the exact instant, those before it get the nanoseconds before, those
//! behind it the nanoseconds after. So the order of delivery is the order of the log, and stamping by log time is exact.

use super::cdr;
use super::error::DatasetError;
use super::ros2::Message;
use arborloop_base::{Span, Time};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions, Writer};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

const CHUNK_BYTES: u64 = 1 << 20;
/// The quickest: ranges are noise, which no level makes smaller.
const ZSTD_LEVEL: u32 = 1;

/// One topic of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TopicSummary {
    /// Its name.
    pub topic: String,
    /// Full ROS name of its type.
    pub message_type: String,
    /// How many messages it has.
    pub messages: u64,
}

/// What a finished recording holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recorded {
    /// SHA-256 over topic, log time and payload of every message in order, in hexadecimal.
    pub content_hash: String,
    /// The same over the labels under `gt/labels`, where there are any.
    pub labels_hash: Option<String>,
    /// How many messages were written.
    pub messages: u64,
    /// From the first message to the last.
    pub duration: Span,
    /// The topics, in the order of their first message.
    pub topics: Vec<TopicSummary>,
}

/// Whether a message claims the instant itself as its log time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moment {
    /// The log time is the instant.
    Exact,
    /// The log time is some nanoseconds beside it where another message claims it.
    Beside,
}

/// The content hash: for each message the topic's length and name, the log time, the payload's length and bytes;
/// numbers as 64-bit little endian.
#[derive(Default)]
pub(super) struct ContentHash(Sha256);

impl ContentHash {
    /// Takes the next message.
    pub(super) fn add(&mut self, topic: &str, log_time: u64, payload: &[u8]) {
        self.0.update((topic.len() as u64).to_le_bytes());
        self.0.update(topic);
        self.0.update(log_time.to_le_bytes());
        self.0.update((payload.len() as u64).to_le_bytes());
        self.0.update(payload);
    }

    /// The hash in hexadecimal.
    pub(super) fn finish(self) -> String {
        hex(&self.0.finalize())
    }
}

/// Bytes in hexadecimal, lower case.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A topic as opened in the file.
pub(super) struct Channel {
    /// Name, type and count so far.
    pub(super) summary: TopicSummary,
    /// REP-2011 hash of the type.
    pub(super) type_hash: &'static str,
    /// Whether a late subscriber must still get the last message.
    pub(super) latched: bool,
    id: u16,
}

struct Held {
    channel: usize,
    payload: Vec<u8>,
    moment: Moment,
}

/// An MCAP being written.
pub(super) struct Bag {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    channels: Vec<Channel>,
    instant: Time,
    held: Vec<Held>,
    hash: ContentHash,
    bounds: Option<(u64, u64)>,
}

impl Bag {
    /// Creates the file, which must not exist, with a metadata record of the given name at its front.
    pub(super) fn create(
        path: &Path,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> Result<Self, DatasetError> {
        let file = File::create_new(path).map_err(DatasetError::io(path, "create"))?;
        let mut writer = WriteOptions::new()
            .profile("ros2")
            .library("arborloop")
            .compression(Some(Compression::Zstd))
            .compression_level(ZSTD_LEVEL)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .create(BufWriter::new(file))
            .map_err(|error| write_error(path, error))?;
        writer
            .write_metadata(&Metadata { name: name.to_owned(), metadata })
            .map_err(|error| write_error(path, error))?;
        Ok(Bag {
            path: path.to_owned(),
            writer,
            channels: Vec::new(),
            instant: Time::default(),
            held: Vec::new(),
            hash: ContentHash::default(),
            bounds: None,
        })
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The topics so far, in the order of their first message.
    pub(super) fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// First and last log time, nanoseconds.
    pub(super) fn bounds(&self) -> Option<(u64, u64)> {
        self.bounds
    }

    /// Writes a message that became known at `now`, no earlier than the message before.
    pub(super) fn write<M: Message>(
        &mut self,
        now: Time,
        topic: &str,
        moment: Moment,
        message: &M,
    ) -> Result<(), DatasetError> {
        if now < self.instant || now.nanos() < 0 {
            return Err(DatasetError::Record {
                path: self.path.clone(),
                what: M::TYPE,
                found: format!("the instant {now} after {}", self.instant),
                wanted: "instants that never go back".to_owned(),
            });
        }
        let payload = cdr::encode(message).map_err(|refusal| refusal.recording(&self.path, M::TYPE))?;
        if now > self.instant {
            self.release()?;
            self.instant = now;
        }
        let channel = self.channel::<M>(topic)?;
        self.held.push(Held { channel, payload, moment });
        Ok(())
    }

    /// Completes the file. Nothing may be written afterwards.
    pub(super) fn finish(&mut self) -> Result<Recorded, DatasetError> {
        self.release()?;
        self.writer.finish().map_err(|error| write_error(&self.path, error))?;
        let (first, last) = self.bounds.unwrap_or_default();
        Ok(Recorded {
            content_hash: std::mem::take(&mut self.hash).finish(),
            labels_hash: None,
            messages: self.channels.iter().map(|channel| channel.summary.messages).sum(),
            duration: Span::from_nanos((last - first) as i64),
            topics: self.channels.iter().map(|channel| channel.summary.clone()).collect(),
        })
    }

    fn channel<M: Message>(&mut self, topic: &str) -> Result<usize, DatasetError> {
        if let Some(known) = self.channels.iter().position(|channel| channel.summary.topic == topic) {
            return Ok(known);
        }
        let latched = matches!(topic, "/tf_static" | "/ouster/metadata" | "/map" | "/ground_truth/map");
        let metadata = BTreeMap::from([
            ("offered_qos_profiles".to_owned(), super::metadata::quality_of_service(latched, "")),
            ("topic_type_hash".to_owned(), M::HASH.to_owned()),
        ]);
        let id = self
            .writer
            .add_schema(M::TYPE, "ros2msg", M::DEFINITION.as_bytes())
            .and_then(|schema| self.writer.add_channel(schema, topic, "cdr", &metadata))
            .map_err(|error| write_error(&self.path, error))?;
        let summary = TopicSummary { topic: topic.to_owned(), message_type: M::TYPE.to_owned(), messages: 0 };
        self.channels.push(Channel { summary, type_hash: M::HASH, latched, id });
        Ok(self.channels.len() - 1)
    }

    /// Writes what was held back of the instant that is over.
    fn release(&mut self) -> Result<(), DatasetError> {
        let instant = self.instant.nanos() as u64;
        let before = self.held.iter().position(|held| held.moment == Moment::Exact).unwrap_or(0) as u64;
        let earliest = self.bounds.map_or(0, |(_, last)| last + 1);
        let first = instant.saturating_sub(before).max(earliest);
        for (log_time, Held { channel, payload, .. }) in (first..).zip(self.held.drain(..)) {
            let channel = &mut self.channels[channel];
            let header = MessageHeader {
                channel_id: channel.id,
                sequence: channel.summary.messages as u32,
                log_time,
                publish_time: log_time,
            };
            self.writer
                .write_to_known_channel(&header, &payload)
                .map_err(|error| write_error(&self.path, error))?;
            self.hash.add(&channel.summary.topic, log_time, &payload);
            channel.summary.messages += 1;
            self.bounds = Some((self.bounds.map_or(log_time, |(first, _)| first), log_time));
        }
        Ok(())
    }
}

fn write_error(path: &Path, error: mcap::McapError) -> DatasetError {
    let source = match error {
        mcap::McapError::Io(source) => source,
        other => std::io::Error::other(other),
    };
    DatasetError::Io { path: path.to_owned(), action: "write", source }
}
