//! The floor that every system must beat: it says that the robot never moved.

use arborloop_base::{Estimate, Health, Observation, Pose, Slam};
use serde::{Deserialize, Serialize};

/// Settings of `still`: there are none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StillSettings {}

/// Answers every sweep with the identity.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Still;

impl Slam for Still {
    fn observe(&mut self, observation: &Observation) -> Option<Estimate> {
        let Observation::Sweep(sweep) = observation else { return None };
        Some(Estimate {
            stamp: sweep.end,
            map_from_base: Pose::identity(),
            covariance: None,
            health: Health::Tracking,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Sweep, Time};

    #[test]
    fn a_system_that_stands_still_answers_at_the_end_of_the_sweep() {
        let sweep = Sweep { end: Time::from_nanos(7), ..Sweep::default() };
        let estimate = Still.observe(&Observation::Sweep(sweep)).unwrap();
        assert_eq!((estimate.stamp, estimate.map_from_base), (Time::from_nanos(7), Pose::identity()));
    }
}
