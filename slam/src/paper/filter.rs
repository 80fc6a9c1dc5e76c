//! The paper's "Pose Refinement": an extended Kalman filter on x, y, heading with the unicycle as motion model.

use super::settings::MhdPaperSettings;
use arborloop_base::wrap_angle;
use nalgebra::{Matrix3, Vector3};

/// State and covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Filter {
    /// x, y (meters), heading (radians); map frame.
    pub(crate) state: Vector3<f64>,
    /// Covariance of the state.
    pub(crate) covariance: Matrix3<f64>,
}

/// Input of the motion model, u = [v, omega].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Drive {
    /// Forward speed, m/s.
    pub(crate) forward_mps: f64,
    /// Turn rate, rad/s.
    pub(crate) turn_radps: f64,
}

impl Filter {
    /// The filter at the origin.
    pub(crate) fn new(settings: &MhdPaperSettings) -> Self {
        Filter { state: Vector3::zeros(), covariance: diagonal(&settings.start_sigma) }
    }

    /// x = f(x, u); P = A P Aᵀ + G Q Gᵀ, with G the time step. The authors' code adds a random draw to every
    /// prediction, which makes their runs unrepeatable; here the prediction is the model's mean.
    pub(crate) fn predict(&mut self, drive: &Drive, elapsed_s: f64, settings: &MhdPaperSettings) {
        let (sin, cos) = self.state.z.sin_cos();
        let way_m = drive.forward_mps * elapsed_s;
        self.state += Vector3::new(way_m * cos, way_m * sin, drive.turn_radps * elapsed_s);
        let mut a = Matrix3::identity();
        (a[(0, 2)], a[(1, 2)]) = (-way_m * sin, way_m * cos);
        let process = diagonal(&settings.motion_sigma) * (elapsed_s * elapsed_s);
        self.covariance = a * self.covariance * a.transpose() + process;
    }

    /// z - z_predicted; the heading is wrapped, which the paper does not mention.
    pub(crate) fn innovation(&self, matched: &Vector3<f64>) -> Vector3<f64> {
        let mut innovation = matched - self.state;
        innovation.z = wrap_angle(innovation.z);
        innovation
    }

    /// Kalman gain, paper "Pose Refinement". The paper prints `P Cᵀ + S⁻¹`; the product `P Cᵀ S⁻¹` is meant, and
    /// C and H are identities: a scan match measures the pose.
    pub(crate) fn update(&mut self, matched: &Vector3<f64>, settings: &MhdPaperSettings) {
        let innovation = self.innovation(matched);
        let s = self.covariance + diagonal(&settings.match_sigma);
        // S is a sum of a positive semidefinite and a positive definite matrix, so the inverse exists.
        let Some(inverse) = s.try_inverse() else { return };
        let gain = self.covariance * inverse;
        self.state += gain * innovation;
        self.state.z = wrap_angle(self.state.z);
        self.covariance -= gain * s * gain.transpose();
    }
}

fn diagonal(sigma: &[f64; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(*sigma).map(|s| s * s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_updated_covariance_is_the_inverse_of_the_summed_information() {
        let settings = MhdPaperSettings::default();
        let mut filter = Filter::new(&settings);
        filter.predict(&Drive { forward_mps: 0.5, turn_radps: 0.2 }, 2.0, &settings);
        let prior = filter.covariance;
        filter.update(&Vector3::new(1.1, 0.1, 0.5), &settings);
        let information =
            prior.try_inverse().unwrap() + diagonal(&settings.match_sigma).try_inverse().unwrap();
        assert!((filter.covariance - information.try_inverse().unwrap()).norm() < 1e-12);
    }

    #[test]
    fn the_update_lies_between_prediction_and_match_also_across_the_cut_of_the_circle() {
        let settings = MhdPaperSettings::default();
        let mut filter = Filter::new(&settings);
        filter.state.z = 3.1;
        filter.update(&Vector3::new(1.0, 0.0, -3.1), &settings);
        assert!(filter.state.x > 0.0 && filter.state.x < 1.0);
        assert!(filter.state.z.abs() > 3.1, "{}", filter.state.z);
    }

    #[test]
    fn the_prediction_follows_the_unicycle_and_its_jacobian() {
        let settings = MhdPaperSettings::default();
        let drive = Drive { forward_mps: 0.5, turn_radps: -0.3 };
        let moved = |heading: f64| {
            let mut filter = Filter::new(&settings);
            filter.state.z = heading;
            filter.predict(&drive, 2.0, &settings);
            filter.state
        };
        assert!((moved(0.4) - Vector3::new(0.4_f64.cos(), 0.4_f64.sin(), -0.2)).norm() < 1e-12);
        let slope = (moved(0.4 + 1e-6) - moved(0.4 - 1e-6)) / 2e-6;
        let expected = Vector3::new(-0.4_f64.sin(), 0.4_f64.cos(), 1.0);
        assert!((slope - expected).norm() < 1e-8);
    }
}
