//! A smooth random field as a sum of plane waves: Gaussian in the limit, of exactly known variance.

use arborloop_base::Stream;
use std::f64::consts::TAU;

/// Plane waves in one field; enough for the central limit, few enough for a large grid.
const WAVES: u64 = 24;
/// Wavelengths are spread by this factor to both sides, so that the field never repeats.
const SPREAD: f64 = 1.5;

struct Wave {
    wavenumber_x: f64,
    wavenumber_y: f64,
    phase_rad: f64,
}

/// Values of a field of mean 0 at every pair of an x and a y, row by row; `deviation` is the standard deviation over
/// all seeds, `wavelength_m` the middle of the band of wavelengths.
pub(crate) fn field(stream: Stream, deviation: f64, wavelength_m: f64, xs: &[f64], ys: &[f64]) -> Vec<f64> {
    let mut values = vec![0.0; xs.len() * ys.len()];
    // A sine of random phase has variance 1/2.
    let amplitude = deviation * (2.0 / WAVES as f64).sqrt();
    for index in 0..WAVES {
        let wave = draw(stream, index, wavelength_m);
        // sin(a + b) = sin a cos b + cos a sin b: two tables instead of a sine per node.
        let along_x: Vec<(f64, f64)> =
            xs.iter().map(|x| (wave.wavenumber_x * x + wave.phase_rad).sin_cos()).collect();
        for (y, row) in ys.iter().zip(values.chunks_exact_mut(xs.len().max(1))) {
            let (sin_y, cos_y) = (wave.wavenumber_y * y).sin_cos();
            let (sin_y, cos_y) = (amplitude * sin_y, amplitude * cos_y);
            for (value, (sin_x, cos_x)) in row.iter_mut().zip(&along_x) {
                *value += sin_x * cos_y + cos_x * sin_y;
            }
        }
    }
    values
}

fn draw(stream: Stream, index: u64, wavelength_m: f64) -> Wave {
    let mut draws = stream.at(index);
    let wavelength_m = wavelength_m * SPREAD.powf(draws.within(-1.0, 1.0));
    let bearing_rad = draws.within(0.0, TAU);
    let wavenumber = TAU / wavelength_m;
    Wave {
        wavenumber_x: wavenumber * bearing_rad.cos(),
        wavenumber_y: wavenumber * bearing_rad.sin(),
        phase_rad: draws.within(0.0, TAU),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    #[test]
    fn over_many_seeds_a_field_has_the_deviation_that_was_asked_for() {
        let n = 4000;
        let square: f64 =
            (0..n).map(|seed| field(Seed(seed).stream("w"), 0.3, 5.0, &[1.7], &[-9.2])[0].powi(2)).sum();
        // A near-Gaussian value's square has a standard deviation of sqrt(2) times its mean: four standard errors.
        let error = (square / n as f64 / 0.09 - 1.0).abs();
        assert!(error < 4.0 * (2.0 / n as f64).sqrt(), "variance off by {error}");
    }

    #[test]
    fn half_a_wavelength_away_the_field_has_changed_sign_on_average() {
        let n = 4000;
        let product: f64 = (0..n)
            .map(|seed| field(Seed(seed).stream("w"), 1.0, 4.0, &[0.0, 2.0], &[0.0]))
            .map(|pair| pair[0] * pair[1])
            .sum();
        // The isotropic field's correlation is the Bessel function J0(pi) = -0.30, blurred by the band of wavelengths.
        assert!(product / (n as f64) < -0.15);
    }
}
