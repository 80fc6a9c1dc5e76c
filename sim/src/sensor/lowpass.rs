//! A sensor's bandwidth: a low-pass of second order without overshoot in its passband (Butterworth).

use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{PI, SQRT_2};

/// Low-pass on a vector that is sampled evenly, by the bilinear transform with its corner in place.
#[derive(Debug, Clone)]
pub(crate) struct LowPass {
    /// Weights of the input now, one and two samples ago.
    forward: [f64; 3],
    /// Weights of the output one and two samples ago.
    back: [f64; 2],
    inputs: [Vector3<f64>; 2],
    outputs: [Vector3<f64>; 2],
}

impl LowPass {
    /// At rest at a value. The corner must be below half the sample rate.
    pub(crate) fn resting(corner_hz: f64, sample_s: f64, value: Vector3<f64>) -> Self {
        let k = (PI * corner_hz * sample_s).tan();
        let scale = 1.0 / (1.0 + SQRT_2 * k + k * k);
        let forward = [k * k * scale, 2.0 * k * k * scale, k * k * scale];
        let back = [2.0 * (1.0 - k * k) * scale, -(1.0 - SQRT_2 * k + k * k) * scale];
        LowPass { forward, back, inputs: [value; 2], outputs: [value; 2] }
    }

    /// Turns what it remembers.
    pub(crate) fn turn(&mut self, turn: &UnitQuaternion<f64>) {
        self.inputs.iter_mut().chain(&mut self.outputs).for_each(|value| *value = turn * *value);
    }

    /// The next sample in, the next filtered one out.
    pub(crate) fn pass(&mut self, value: Vector3<f64>) -> Vector3<f64> {
        let [b0, b1, b2] = self.forward;
        let [a1, a2] = self.back;
        let out = value * b0
            + self.inputs[0] * b1
            + self.inputs[1] * b2
            + self.outputs[0] * a1
            + self.outputs[1] * a2;
        self.inputs = [value, self.inputs[0]];
        self.outputs = [out, self.outputs[0]];
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// How much of a sine is left, by the power of what comes out of long waves.
    fn gain(hz: f64) -> f64 {
        let mut filter = LowPass::resting(150.0, 1e-3, Vector3::zeros());
        let mut power = 0.0;
        for n in 0..6000 {
            let out = filter.pass(Vector3::x() * (TAU * hz * f64::from(n) * 1e-3).sin()).x;
            power += if n >= 1000 { out * out / 5000.0 } else { 0.0 };
        }
        (2.0 * power).sqrt()
    }

    #[test]
    fn half_the_power_passes_at_the_corner_all_of_it_far_below_and_little_above() {
        assert!((gain(150.0) - 0.5_f64.sqrt()).abs() < 1e-3, "{}", gain(150.0));
        assert!((gain(10.0) - 1.0).abs() < 1e-3);
        // The analog filter has 1 / sqrt(1 + 16) at twice the corner; the digital one falls faster.
        assert!(gain(300.0) < 1.0 / 17_f64.sqrt());
    }

    #[test]
    fn a_constant_stays_what_it_is() {
        let value = Vector3::new(1.0, -2.0, 9.8);
        let mut filter = LowPass::resting(150.0, 1e-3, value);
        for _ in 0..100 {
            assert!((filter.pass(value) - value).norm() < 1e-9);
        }
    }
}
