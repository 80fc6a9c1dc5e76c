//! A damped oscillator with its exact step: the same motion at every tick length.

use std::f64::consts::TAU;

/// `x'' = w^2 (target - x) - 2 z w x'`, underdamped, stepped exactly for a target that holds during the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Oscillator {
    /// Where it is.
    pub(crate) x: f64,
    /// How fast it moves, per second.
    pub(crate) rate: f64,
    natural_radps: f64,
    /// The step's matrix, from (x - target, rate) to the same after one tick.
    step: [[f64; 2]; 2],
}

impl Oscillator {
    /// At rest at `x`. The damping ratio must be below 1.
    pub(crate) fn at_rest(x: f64, natural_hz: f64, damping_ratio: f64, tick_s: f64) -> Self {
        let w = TAU * natural_hz;
        let decay = damping_ratio * w;
        let ring = w * (1.0 - damping_ratio * damping_ratio).sqrt();
        let (sin, cos) = (ring * tick_s).sin_cos();
        let left = (-decay * tick_s).exp();
        let step = [
            [left * (cos + decay / ring * sin), left * sin / ring],
            [-left * w * w / ring * sin, left * (cos - decay / ring * sin)],
        ];
        Oscillator { x, rate: 0.0, natural_radps: w, step }
    }

    /// One tick toward a target.
    pub(crate) fn advance(&mut self, target: f64) {
        let offset = self.x - target;
        let [[a, b], [c, d]] = self.step;
        (self.x, self.rate) = (target + a * offset + b * self.rate, c * offset + d * self.rate);
    }

    /// One tick toward zero under an acceleration from outside.
    pub(crate) fn push(&mut self, acceleration: f64) {
        self.advance(acceleration / (self.natural_radps * self.natural_radps));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillator_moves_the_same_at_every_tick_length() {
        let after = |ticks: u32| {
            let mut one = Oscillator::at_rest(0.0, 4.0, 0.6, 0.12 / f64::from(ticks));
            (0..ticks).for_each(|_| one.advance(1.0));
            (one.x, one.rate)
        };
        let ((x, rate), (x_fine, rate_fine)) = (after(3), after(240));
        assert!((x - x_fine).abs() < 1e-12 && (rate - rate_fine).abs() < 1e-9);
    }

    #[test]
    fn an_oscillator_obeys_its_equation() {
        let tick_s = 1e-5;
        let mut one = Oscillator::at_rest(0.3, 35.0, 0.2, tick_s);
        one.rate = 2.0;
        let w = TAU * 35.0;
        let wanted = w * w * (0.1 - one.x) - 2.0 * 0.2 * w * one.rate;
        let before = one.rate;
        one.advance(0.1);
        assert!(((one.rate - before) / tick_s / wanted - 1.0).abs() < 0.01);
    }
}
