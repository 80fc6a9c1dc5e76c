//! A recorder on a thread of its own: a run goes on while its messages are encoded, compressed and written.
//!
//! The order of records is the order of writing, so the recording is the same to the bit. What cannot be written comes
//! out of a later write or of the end, as the recorder said it; nothing behind it is written.

use super::error::DatasetError;
use super::recorder::Recorder;
use arborloop_base::{Cell, Estimate, Grid, Label, Observation, Record, Sink, SinkError, Time, Truth, Twist};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Batches that wait for a slow disk before the run waits too: about half a second of records.
const WAITING: usize = 4;

/// Hands records over to a [`Recorder`]. Dropping it unfinished writes what it was given and closes the files.
pub struct BackgroundRecorder {
    batch: Vec<(Time, Kept)>,
    /// `None` once the recording has ended.
    batches: Option<SyncSender<Vec<(Time, Kept)>>>,
    writer: Option<JoinHandle<Result<Recorder, DatasetError>>>,
    /// Labels go into data sets alone.
    labels: bool,
}

/// A record that is kept until it is written.
enum Kept {
    Observation(Arc<Observation>),
    /// Of the sweep before.
    Labels(Vec<Label>),
    Estimate {
        system: String,
        estimate: Estimate,
    },
    Truth(Truth),
    Joints {
        names: Vec<String>,
        angles_rad: Vec<f64>,
    },
    Command(Twist),
    Map {
        system: String,
        map: Grid<Cell>,
    },
}

impl BackgroundRecorder {
    /// Records go to this recorder from now on.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn start(recorder: Recorder) -> Result<Self, DatasetError> {
        let (batches, received) = sync_channel(WAITING);
        let (path, labels) = (recorder.path().to_owned(), recorder.keeps_labels());
        let writer = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || write_all(recorder, &received))
            .map_err(DatasetError::io(&path, "write"))?;
        Ok(BackgroundRecorder { batch: Vec::new(), batches: Some(batches), writer: Some(writer), labels })
    }

    /// The recorder, once it has written everything.
    ///
    /// # Errors
    /// What it could not write, also of records that were taken without complaint before. `None` where a write has
    /// already said so.
    pub fn finish(mut self) -> Result<Option<Recorder>, DatasetError> {
        self.end()
    }

    fn end(&mut self) -> Result<Option<Recorder>, DatasetError> {
        if let Some(batches) = self.batches.take() {
            // A writer that is gone says why when it is joined.
            let _ = batches.send(std::mem::take(&mut self.batch));
        }
        match self.writer.take().map(JoinHandle::join) {
            Some(Ok(ended)) => ended.map(Some),
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => Ok(None),
        }
    }

    /// Copies a record, or leaves out one that the recorder would leave out.
    fn keep(&self, record: &Record<'_>) -> Option<Kept> {
        Some(match record {
            Record::Observation(observation) => Kept::Observation(Arc::new((*observation).clone())),
            Record::Labels { labels, .. } if self.labels => Kept::Labels(labels.to_vec()),
            Record::Labels { .. } => return None,
            Record::Estimate { system, estimate } => {
                Kept::Estimate { system: (*system).to_owned(), estimate: **estimate }
            }
            Record::Truth(truth) => Kept::Truth((*truth).clone()),
            Record::Joints { names, angles_rad } => {
                Kept::Joints { names: names.to_vec(), angles_rad: angles_rad.to_vec() }
            }
            Record::Command(twist) => Kept::Command(**twist),
            Record::Map { system, map } => Kept::Map { system: (*system).to_owned(), map: (*map).clone() },
        })
    }
}

impl Sink for BackgroundRecorder {
    fn write(&mut self, now: Time, record: &Record<'_>) -> Result<(), SinkError> {
        // A sweep's command is its last record: with it a batch is whole.
        let whole = matches!(record, Record::Command(_));
        if let Some(kept) = self.keep(record) {
            self.batch.push((now, kept));
        }
        let Some(batches) = self.batches.as_ref().filter(|_| whole) else { return Ok(()) };
        let next = Vec::with_capacity(self.batch.len());
        if batches.send(std::mem::replace(&mut self.batch, next)).is_err() {
            self.batches = None;
            self.end()?;
        }
        Ok(())
    }

    fn write_observation(&mut self, now: Time, observation: &Arc<Observation>) -> Result<(), SinkError> {
        self.batch.push((now, Kept::Observation(observation.clone())));
        Ok(())
    }
}

impl Drop for BackgroundRecorder {
    fn drop(&mut self) {
        // Nobody is left to tell, and a panic here would end the program.
        if let Some(batches) = self.batches.take() {
            let _ = batches.send(std::mem::take(&mut self.batch));
        }
        let _ = self.writer.take().map(JoinHandle::join);
    }
}

/// Writes until the run has no more to say.
fn write_all(
    mut recorder: Recorder,
    batches: &Receiver<Vec<(Time, Kept)>>,
) -> Result<Recorder, DatasetError> {
    let keeps_labels = recorder.keeps_labels();
    let mut before: Option<Arc<Observation>> = None;
    for (now, kept) in batches.iter().flatten() {
        match kept {
            Kept::Observation(observation) => {
                recorder.record(now, &Record::Observation(&observation))?;
                if matches!(*observation, Observation::Sweep(_)) {
                    before = keeps_labels.then_some(observation);
                }
            }
            Kept::Labels(labels) => {
                if let Some(Observation::Sweep(sweep)) = before.as_deref() {
                    recorder.record(now, &Record::Labels { sweep, labels: &labels })?;
                }
            }
            Kept::Estimate { system, estimate } => {
                recorder.record(now, &Record::Estimate { system: &system, estimate: &estimate })?;
            }
            Kept::Truth(truth) => recorder.record(now, &Record::Truth(&truth))?,
            Kept::Joints { names, angles_rad } => {
                recorder.record(now, &Record::Joints { names: &names, angles_rad: &angles_rad })?;
            }
            Kept::Command(twist) => recorder.record(now, &Record::Command(&twist))?,
            Kept::Map { system, map } => {
                recorder.record(now, &Record::Map { system: &system, map: &map })?;
            }
        }
    }
    Ok(recorder)
}
