//! How numbers are written for people, and where an axis has its ticks.

/// Three significant digits, at most five decimals; small numbers with a power of ten.
pub(super) fn text(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        return "n/a".to_owned();
    }
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e7).contains(&size) {
        return format!("{value:.1e}").replace('-', "\u{2212}");
    }
    let decimals = (2 - size.log10().floor() as i64).clamp(0, 5) as usize;
    format!("{value:.decimals$}").replace('-', "\u{2212}")
}

/// As [`text`] without zeros at the end: for steps and limits, which are exact.
pub(super) fn short(value: f64) -> String {
    let text = text(value);
    if text.contains('.') && !text.contains('e') {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    text
}

/// As [`text`], or `n/a`.
pub(super) fn text_or(value: Option<f64>) -> String {
    value.map_or_else(|| "n/a".to_owned(), text)
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`; 1 for nothing positive.
pub(super) fn nice_at_least(least: f64) -> f64 {
    if !(least.is_finite() && least > 1e-300) {
        return 1.0;
    }
    let power = 10_f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= least * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A linear axis that covers some values and begins and ends on a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub(super) low: f64,
    pub(super) high: f64,
    step: f64,
    /// Whether `low`, `high` and `step` are powers of ten.
    logarithmic: bool,
}

impl Axis {
    /// Covers `low..=high` by about `ticks` steps.
    pub(super) fn covering(low: f64, high: f64, ticks: usize) -> Self {
        let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
        let span = if high - low > 1e-12 * (1.0 + low.abs().max(high.abs())) { high - low } else { 1.0 };
        let step = nice_at_least(span / ticks.max(1) as f64);
        let high = low + span.max(high - low);
        Axis {
            low: (low / step).floor() * step,
            high: (high / step - 1e-9).ceil() * step,
            step,
            logarithmic: false,
        }
    }

    /// Begins and ends exactly where told, with about `ticks` steps between.
    pub(super) fn exactly(low: f64, high: f64, ticks: usize) -> Self {
        let high = if high - low > 1e-9 { high } else { low + 1.0 };
        Axis { low, high, step: nice_at_least((high - low) / ticks.max(1) as f64), logarithmic: false }
    }

    /// Whole decades that cover two positive values, a step of one decade.
    pub(super) fn decades(low: f64, high: f64) -> Self {
        let low = low.log10().floor();
        Axis { low, high: high.log10().ceil().max(low + 1.0), step: 1.0, logarithmic: true }
    }

    /// Where a value lies: 0 at the low end, 1 at the high end. A logarithmic axis puts what is below it at its low end.
    pub(super) fn share(&self, value: f64) -> f64 {
        let value = if self.logarithmic { value.max(0.0).log10().max(self.low) } else { value };
        (value - self.low) / (self.high - self.low)
    }

    /// Each tick's share and label.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic {
            let decade =
                |n: i64| ((n as f64 - self.low) / (self.high - self.low), short(10_f64.powi(n as i32)));
            return (self.low as i64..=self.high as i64).map(decade).collect();
        }
        let decimals = (-self.step.log10().floor()).clamp(0.0, 9.0) as usize;
        let first = (self.low / self.step - 1e-9).ceil() as i64;
        let last = (self.high / self.step + 1e-9).floor() as i64;
        (first..=last.min(first + 50))
            .map(|n| n as f64 * self.step)
            .map(|value| (self.share(value), format!("{value:.decimals$}").replace('-', "\u{2212}")))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let written: Vec<_> =
            [0.0, 0.01834, 1.2345, 12.345, 123.45, 76543.2, 0.00001, f64::NAN, -0.5].map(text).into();
        assert_eq!(
            written,
            ["0", "0.0183", "1.23", "12.3", "123", "76543", "1.0e\u{2212}5", "n/a", "\u{2212}0.500"]
        );
    }

    #[test]
    fn an_axis_covers_its_values_and_its_ticks_are_round() {
        for (low, high) in
            [(0.0, 0.083), (-3.0, 4.0), (5.0, 5.0), (0.0, 1e-9), (1e6, 1e6 + 3.0), (f64::NAN, 1.0)]
        {
            let axis = Axis::covering(low, high, 4);
            assert!(axis.high > axis.low, "{axis:?}");
            assert!(!(low < axis.low - 1e-9 || high > axis.high + 1e-9), "{axis:?}");
            let ticks = axis.ticks();
            assert!((2..=7).contains(&ticks.len()), "{ticks:?}");
            assert!(ticks[0].0.abs() < 1e-6 && (ticks[ticks.len() - 1].0 - 1.0).abs() < 1e-6, "{ticks:?}");
        }
        let labels: Vec<_> =
            Axis::covering(0.0, 0.083, 4).ticks().into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0.00", "0.05", "0.10"]);
    }

    #[test]
    fn decades_have_a_tick_each_and_hold_zero_at_their_foot() {
        let axis = Axis::decades(0.004, 3.0);
        let labels: Vec<_> = axis.ticks().into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0.001", "0.01", "0.1", "1", "10"]);
        assert_eq!((axis.share(0.0), axis.share(10.0)), (0.0, 1.0));
        assert!((axis.share(0.1) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn exact_numbers_are_written_without_zeros_behind() {
        let written: Vec<_> = [2.0, 0.02, 10.0, 0.25, 100.0, 1500.0, 0.0].map(short).into();
        assert_eq!(written, ["2", "0.02", "10", "0.25", "100", "1500", "0"]);
    }

    #[test]
    fn nice_steps_are_one_two_or_five() {
        for (least, nice) in [(0.9, 1.0), (1.1, 2.0), (2.0, 2.0), (0.021, 0.05), (60.0, 100.0), (0.0, 1.0)] {
            assert!((nice_at_least(least) - nice).abs() < 1e-12 * nice, "{least}");
        }
    }
}
