//! An MCAP read from front to back, without its index: so a file that was cut off is readable as far as it goes.

use super::error::DatasetError;
use mcap::McapError;
use mcap::records::{Record, Statistics};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{ErrorKind, Read, Seek};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// No record of a sane recording is longer; a damaged length must not ask for all memory.
const RECORD_BYTES_MAX: usize = 1 << 30;
const READ_BYTES_MAX: usize = 1 << 18;

/// A topic as the file names it.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Topic {
    /// Its name.
    pub(super) name: String,
    /// ROS type, empty when the file gives none.
    pub(super) message_type: String,
    /// Message encoding, `cdr` for ROS 2.
    pub(super) encoding: String,
}

/// What stands in a file, in its order.
pub(super) enum Item {
    /// A message of a topic.
    Message {
        /// The topic.
        topic: Rc<Topic>,
        /// When it was logged, nanoseconds.
        log_time: u64,
        /// Its bytes.
        payload: Vec<u8>,
    },
    /// A metadata record.
    Metadata {
        /// Its name.
        name: String,
        /// Its entries.
        entries: BTreeMap<String, String>,
    },
}

/// A cursor over one file or over the files of a split recording. After an error it is over.
pub(super) struct McapCursor {
    waiting: VecDeque<PathBuf>,
    open: Option<OpenFile>,
}

struct OpenFile {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    schemas: BTreeMap<u16, String>,
    topics: BTreeMap<u16, Rc<Topic>>,
    messages: u64,
    past_data: bool,
}

impl McapCursor {
    /// A cursor at the front of the first file.
    pub(super) fn new(files: &[PathBuf]) -> Self {
        McapCursor { waiting: files.iter().cloned().collect(), open: None }
    }

    /// The file under the cursor.
    pub(super) fn path(&self) -> &Path {
        self.open.as_ref().map_or(Path::new(""), |open| &open.path)
    }

    /// The next item, or `None` behind the last.
    pub(super) fn next(&mut self) -> Option<Result<Item, DatasetError>> {
        loop {
            if self.open.is_none() {
                match OpenFile::open(self.waiting.pop_front()?) {
                    Ok(open) => self.open = Some(open),
                    Err(error) => return Some(Err(self.give_up(error))),
                }
            }
            match self.open.as_mut()?.next() {
                Some(Ok(item)) => return Some(Ok(item)),
                Some(Err(error)) => return Some(Err(self.give_up(error))),
                None if self.waiting.is_empty() => {
                    self.open = None;
                    return None;
                }
                None => self.open = None,
            }
        }
    }

    fn give_up(&mut self, error: DatasetError) -> DatasetError {
        self.waiting.clear();
        self.open = None;
        error
    }
}

impl OpenFile {
    fn open(path: PathBuf) -> Result<Self, DatasetError> {
        let file = File::open(&path).map_err(DatasetError::io(&path, "open"))?;
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_BYTES_MAX);
        let reader = LinearReader::new_with_options(options);
        let (schemas, topics) = (BTreeMap::new(), BTreeMap::new());
        Ok(OpenFile { path, file, reader, schemas, topics, messages: 0, past_data: false })
    }

    fn next(&mut self) -> Option<Result<Item, DatasetError>> {
        loop {
            match self.reader.next_event()? {
                Err(error) => return Some(Err(damaged(&self.path, self.messages, error))),
                Ok(LinearReadEvent::ReadRequest(need)) => {
                    // Whole blocks at a time; the reader keeps what it did not ask for yet.
                    let read =
                        read_some(&mut self.file, self.reader.insert(need.clamp(1 << 12, READ_BYTES_MAX)));
                    match read {
                        Ok(read) => self.reader.notify_read(read),
                        Err(source) => {
                            return Some(Err(DatasetError::Io {
                                path: self.path.clone(),
                                action: "read",
                                source,
                            }));
                        }
                    }
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let record = match mcap::parse_record(opcode, data) {
                        Ok(record) => record,
                        Err(error) => return Some(Err(damaged(&self.path, self.messages, error))),
                    };
                    // The summary repeats schemas and channels.
                    if self.past_data {
                        continue;
                    }
                    match record {
                        Record::Schema { header, .. } => {
                            self.schemas.insert(header.id, header.name);
                        }
                        Record::Channel(channel) => {
                            let message_type =
                                self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                            let topic = Topic {
                                name: channel.topic,
                                message_type,
                                encoding: channel.message_encoding,
                            };
                            self.topics.insert(channel.id, Rc::new(topic));
                        }
                        Record::Message { header, data } => {
                            let Some(topic) = self.topics.get(&header.channel_id) else {
                                let error = McapError::UnknownChannel(header.sequence, header.channel_id);
                                return Some(Err(damaged(&self.path, self.messages, error)));
                            };
                            self.messages += 1;
                            return Some(Ok(Item::Message {
                                topic: Rc::clone(topic),
                                log_time: header.log_time,
                                payload: data.into_owned(),
                            }));
                        }
                        Record::Metadata(metadata) => {
                            return Some(Ok(Item::Metadata {
                                name: metadata.name,
                                entries: metadata.metadata,
                            }));
                        }
                        Record::DataEnd(_) => self.past_data = true,
                        _ => {}
                    }
                }
            }
        }
    }
}

/// Topics with their message counts from the summary at a file's end; `None` when there is none that is whole.
pub(super) fn summary(path: &Path) -> Option<Vec<(Topic, u64)>> {
    let mut file = File::open(path).ok()?;
    let options = SummaryReaderOptions::default()
        .with_file_size(file.metadata().ok()?.len())
        .with_record_length_limit(RECORD_BYTES_MAX);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            SummaryReadEvent::ReadRequest(need) => {
                let read = read_some(&mut file, reader.insert(need.min(READ_BYTES_MAX))).ok()?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to).ok()?),
        }
    }
    let summary = reader.finish()?;
    let Statistics { channel_message_counts, .. } = summary.stats?;
    let topics = summary.channels.values().map(|channel| {
        let message_type = channel.schema.as_ref().map_or(String::new(), |schema| schema.name.clone());
        let topic =
            Topic { name: channel.topic.clone(), message_type, encoding: channel.message_encoding.clone() };
        (topic, channel_message_counts.get(&channel.id).copied().unwrap_or_default())
    });
    // The map of channels has no order of its own.
    let mut topics: Vec<_> = topics.collect();
    topics.sort_by(|a, b| a.0.name.cmp(&b.0.name));
    Some(topics)
}

fn read_some(file: &mut File, buffer: &mut [u8]) -> std::io::Result<usize> {
    loop {
        match file.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

fn damaged(path: &Path, messages: u64, error: McapError) -> DatasetError {
    let what = match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc => "the file ends".to_owned(),
        McapError::BadMagic => "no MCAP magic".to_owned(),
        other => format!("damage ({other})"),
    };
    DatasetError::Damaged { path: path.to_owned(), what, messages }
}
