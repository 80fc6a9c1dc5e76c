//! One clock: integer nanoseconds, so that sums never drift and stamps compare exactly.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// An instant on the recording's clock, nanoseconds.
///
/// A simulated clock starts at [`Time::SIMULATION_START`], because a zero stamp means "unset" to ROS tools;
/// a real recording counts from the Unix epoch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Time(i64);

/// A difference of two instants, nanoseconds; may be negative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Span(i64);

impl Time {
    /// Where every simulated clock begins: one second.
    pub const SIMULATION_START: Time = Time(1_000_000_000);

    /// The instant `nanos` after the clock's zero.
    pub const fn from_nanos(nanos: i64) -> Self {
        Time(nanos)
    }

    /// The instant nearest to `seconds`; exact to a nanosecond below about 10^6 s.
    pub fn from_seconds(seconds: f64) -> Self {
        Time((seconds * 1e9).round() as i64)
    }

    /// Nanoseconds since the clock's zero.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Seconds since the clock's zero, for display and interpolation.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }
}

impl Span {
    /// No time at all.
    pub const ZERO: Span = Span(0);

    /// A span of `nanos` nanoseconds.
    pub const fn from_nanos(nanos: i64) -> Self {
        Span(nanos)
    }

    /// A span of `millis` milliseconds.
    pub const fn from_millis(millis: i64) -> Self {
        Span(millis * 1_000_000)
    }

    /// The span nearest to `seconds`.
    pub fn from_seconds(seconds: f64) -> Self {
        Span((seconds * 1e9).round() as i64)
    }

    /// Nanoseconds.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Seconds.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// How many whole `step`s make this span, or `None` when it is no whole number of them.
    pub fn whole_steps(self, step: Span) -> Option<i64> {
        (step.0 > 0 && self.0 % step.0 == 0).then(|| self.0 / step.0)
    }

    /// The magnitude.
    pub const fn abs(self) -> Span {
        Span(self.0.abs())
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:09}", self.0.div_euclid(1_000_000_000), self.0.rem_euclid(1_000_000_000))
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} s", self.seconds())
    }
}

impl Sub for Time {
    type Output = Span;
    fn sub(self, earlier: Time) -> Span {
        Span(self.0 - earlier.0)
    }
}

impl Add<Span> for Time {
    type Output = Time;
    fn add(self, span: Span) -> Time {
        Time(self.0 + span.0)
    }
}

impl Sub<Span> for Time {
    type Output = Time;
    fn sub(self, span: Span) -> Time {
        Time(self.0 - span.0)
    }
}

impl AddAssign<Span> for Time {
    fn add_assign(&mut self, span: Span) {
        self.0 += span.0;
    }
}

impl Add for Span {
    type Output = Span;
    fn add(self, other: Span) -> Span {
        Span(self.0 + other.0)
    }
}

impl Sub for Span {
    type Output = Span;
    fn sub(self, other: Span) -> Span {
        Span(self.0 - other.0)
    }
}

impl Mul<i64> for Span {
    type Output = Span;
    fn mul(self, count: i64) -> Span {
        Span(self.0 * count)
    }
}

impl Div<i64> for Span {
    type Output = Span;
    fn div(self, count: i64) -> Span {
        Span(self.0 / count)
    }
}

impl Neg for Span {
    type Output = Span;
    fn neg(self) -> Span {
        Span(-self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instant_prints_as_seconds_with_nine_decimals() {
        assert_eq!(Time::from_nanos(1_000_000_001).to_string(), "1.000000001");
        assert_eq!(Time::from_nanos(1_691_337_600_123_456_789).to_string(), "1691337600.123456789");
    }

    #[test]
    fn a_period_that_is_no_whole_number_of_ticks_is_noticed() {
        let tick = Span::from_millis(1);
        assert_eq!(Span::from_millis(100).whole_steps(tick), Some(100));
        assert_eq!(Span::from_nanos(100_500_000).whole_steps(tick), None);
        assert_eq!(Span::from_millis(100).whole_steps(Span::ZERO), None);
    }
}
