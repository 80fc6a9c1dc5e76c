//! A recording's observations in the order in which they were delivered, one at a time.

use super::cdr;
use super::cloud::{self, Rings};
use super::error::{DatasetError, Place, Refusal};
use super::geodesy::Datum;
use super::index::{LidarForm, Topics};
use super::mcap_file::{Item, McapCursor, Topic};
use super::recording::front::Front;
use super::ros2::{Message, NavSatFix};
use super::{ouster, packets, scan, states};
use arborloop_base::os1::Os1;
use arborloop_base::{Observation, Sweep, Time};
use std::collections::BTreeMap;

/// Reads messages and keeps those that are observations. After an error it is over.
pub(super) struct Observations<'a> {
    cursor: McapCursor,
    topics: &'a Topics,
    rings: Rings,
    datum: Option<Datum>,
    ouster: Option<&'a Os1>,
    end_is_log_time: bool,
    counts: BTreeMap<String, u64>,
    over: bool,
}

impl<'a> Observations<'a> {
    /// Where the front names no datum the first fix becomes it. That a sweep is logged at its end is our recorder's
    /// promise.
    pub(super) fn new(cursor: McapCursor, topics: &'a Topics, front: &'a Front) -> Self {
        Observations {
            cursor,
            topics,
            rings: Rings::default(),
            datum: front.datum,
            ouster: front.ouster.as_ref().filter(|_| front.ours),
            end_is_log_time: front.ours,
            counts: BTreeMap::new(),
            over: false,
        }
    }

    fn observation(
        &mut self,
        topic: &Topic,
        log_time: u64,
        payload: &[u8],
    ) -> Result<Option<Observation>, Refusal> {
        let name = Some(&topic.name);
        let observation = if topic.name == self.topics.lidar {
            Observation::Sweep(self.sweep(topic, log_time, payload)?)
        } else if name == self.topics.imu.as_ref() {
            Observation::Imu(states::imu_of(&decode(topic, payload)?))
        } else if name == self.topics.odometry.as_ref() {
            Observation::Odometry(states::odometry_of(&decode(topic, payload)?))
        } else if name == self.topics.fix.as_ref() {
            let message: NavSatFix = decode(topic, payload)?;
            // A receiver without a position says NaN: the first one that has one makes the datum.
            let place = states::datum_of(&message);
            if self.datum.is_none() && place.is_finite() {
                self.datum = Some(place);
            }
            Observation::Fix(states::fix_of(&message, &self.datum.unwrap_or(place)))
        } else {
            return Ok(None);
        };
        Ok(Some(observation))
    }

    fn sweep(&mut self, topic: &Topic, log_time: u64, payload: &[u8]) -> Result<Sweep, Refusal> {
        // A log time beyond the year 2116 is damage, and differences with it would leave 64 bits.
        let end = (self.end_is_log_time && log_time < 1 << 62).then(|| Time::from_nanos(log_time as i64));
        match self.topics.form {
            LidarForm::Packets => packets::sweep_of(&decode(topic, payload)?),
            LidarForm::Cloud => match self.ouster {
                Some(sensor) => ouster::sweep_of(sensor, &decode(topic, payload)?),
                None => cloud::sweep_of(&decode(topic, payload)?, end, &mut self.rings),
            },
            LidarForm::Scan => scan::sweep_of(&decode(topic, payload)?, end),
        }
    }
}

impl Iterator for Observations<'_> {
    type Item = Result<Observation, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.over {
            let (topic, log_time, payload) = match self.cursor.next() {
                Some(Ok(Item::Message { topic, log_time, payload })) => (topic, log_time, payload),
                Some(Ok(Item::Metadata { .. })) => continue,
                Some(Err(error)) => {
                    self.over = true;
                    return Some(Err(error));
                }
                None => break,
            };
            match self.observation(&topic, log_time, &payload) {
                Ok(None) => {}
                Ok(Some(observation)) => {
                    *self.counts.entry(topic.name.clone()).or_default() += 1;
                    return Some(Ok(observation));
                }
                Err(refusal) => {
                    self.over = true;
                    let index = self.counts.get(&topic.name).copied().unwrap_or_default();
                    let place = Place::Message { topic: topic.name.clone(), index };
                    return Some(Err(refusal.at(self.cursor.path(), place)));
                }
            }
        }
        self.over = true;
        None
    }
}

/// The message of a payload, after checking that the topic says so.
pub(super) fn decode<M: Message>(topic: &Topic, payload: &[u8]) -> Result<M, Refusal> {
    if topic.encoding != "cdr" || topic.message_type != M::TYPE {
        let found = format!("type `{}`, encoding `{}`", topic.message_type, topic.encoding);
        return Err(Refusal::new(found, format!("type `{}`, encoding `cdr`", M::TYPE)));
    }
    cdr::decode(payload)
}
