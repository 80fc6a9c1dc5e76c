//! The form in which a lidar's sweeps travel: what a system is fed and what a recording keeps are the same bits.

use crate::observation::Sweep;
use crate::os1::{FrameError, Os1};
use crate::vlp16::{self, ReturnMode, WireError};

/// How a lidar speaks.
#[derive(Debug, Clone, PartialEq)]
pub enum Wire {
    /// Data packets of a VLP-16.
    Vlp16(ReturnMode),
    /// Frames of an Ouster sensor.
    Ouster(Os1),
    /// Points as they are: a lidar without a wire form of its own.
    Plain,
}

impl Default for Wire {
    fn default() -> Self {
        Wire::Vlp16(ReturnMode::Strongest)
    }
}

/// Why a sweep cannot travel.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CarryError {
    /// It is none of a VLP-16's.
    #[error(transparent)]
    Vlp16(#[from] WireError),
    /// It is none of the Ouster sensor's.
    #[error(transparent)]
    Ouster(#[from] FrameError),
}

impl Wire {
    /// The sweep as it arrives: rounded to the wire's steps. A sweep that traveled once travels unchanged.
    ///
    /// A sweep begins with its first return; one without returns keeps its start.
    ///
    /// # Errors
    /// A sweep with firings that this lidar does not make.
    pub fn carry(&self, sweep: &Sweep) -> Result<Sweep, CarryError> {
        match self {
            _ if sweep.returns.is_empty() => Ok(sweep.clone()),
            Wire::Vlp16(mode) => Ok(vlp16::decode(&vlp16::encode_as(sweep, *mode)?, sweep.end)?),
            Wire::Ouster(sensor) => Ok(sensor.decode(&sensor.encode(sweep)?)?),
            Wire::Plain => {
                let mut carried = sweep.clone();
                if let Some(first) = sweep.returns.first() {
                    carried.start += first.fired_after;
                    carried
                        .returns
                        .iter_mut()
                        .for_each(|one| one.fired_after = one.fired_after - first.fired_after);
                }
                Ok(carried)
            }
        }
    }
}
