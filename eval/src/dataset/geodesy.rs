//! Between a site's east-north-up and WGS-84 latitude, longitude, height: by way of Earth-centered coordinates, no flat Earth.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Semi-major axis of WGS-84, meters.
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening of WGS-84.
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
const ECCENTRICITY2: f64 = FLATTENING * (2.0 - FLATTENING);

/// Where on Earth the origin of a site's east-north-up frame lies (WGS-84).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Datum {
    /// Geodetic latitude, degrees, north positive.
    pub latitude_deg: f64,
    /// Longitude, degrees, east positive.
    pub longitude_deg: f64,
    /// Height above the ellipsoid, meters.
    pub altitude_m: f64,
}

impl Datum {
    /// The point at an east, north, up offset in meters.
    pub(super) fn offset(&self, enu_m: &Vector3<f64>) -> Datum {
        from_ecef(&(to_ecef(self) + self.ecef_from_enu() * enu_m))
    }

    /// Whether all three numbers are.
    pub(super) fn is_finite(&self) -> bool {
        [self.latitude_deg, self.longitude_deg, self.altitude_m].iter().all(|number| number.is_finite())
    }

    /// East, north, up of a point as seen from here, meters.
    pub(super) fn offset_to(&self, point: &Datum) -> Vector3<f64> {
        self.ecef_from_enu().transpose() * (to_ecef(point) - to_ecef(self))
    }

    /// Columns are east, north and up in Earth-centered axes.
    fn ecef_from_enu(&self) -> Matrix3<f64> {
        let (sin_lat, cos_lat) = self.latitude_deg.to_radians().sin_cos();
        let (sin_lon, cos_lon) = self.longitude_deg.to_radians().sin_cos();
        Matrix3::new(
            -sin_lon,
            -sin_lat * cos_lon,
            cos_lat * cos_lon,
            cos_lon,
            -sin_lat * sin_lon,
            cos_lat * sin_lon,
            0.0,
            cos_lat,
            sin_lat,
        )
    }
}

fn prime_vertical_m(sin_lat: f64) -> f64 {
    SEMI_MAJOR_M / (1.0 - ECCENTRICITY2 * sin_lat * sin_lat).sqrt()
}

fn to_ecef(point: &Datum) -> Vector3<f64> {
    let (sin_lat, cos_lat) = point.latitude_deg.to_radians().sin_cos();
    let (sin_lon, cos_lon) = point.longitude_deg.to_radians().sin_cos();
    let normal = prime_vertical_m(sin_lat);
    let across = (normal + point.altitude_m) * cos_lat;
    Vector3::new(
        across * cos_lon,
        across * sin_lon,
        (normal * (1.0 - ECCENTRICITY2) + point.altitude_m) * sin_lat,
    )
}

/// Fixed-point iteration on the latitude; each round gains more than two digits near the surface.
fn from_ecef(ecef: &Vector3<f64>) -> Datum {
    let across = ecef.x.hypot(ecef.y);
    let mut latitude = ecef.z.atan2(across * (1.0 - ECCENTRICITY2));
    for _ in 0..10 {
        let sin_lat = latitude.sin();
        latitude = (ecef.z + ECCENTRICITY2 * prime_vertical_m(sin_lat) * sin_lat).atan2(across);
    }
    let (sin_lat, cos_lat) = latitude.sin_cos();
    // Projected on the ellipsoid's normal, which stays well-conditioned at the poles.
    let altitude_m =
        across * cos_lat + ecef.z * sin_lat - SEMI_MAJOR_M * (1.0 - ECCENTRICITY2 * sin_lat * sin_lat).sqrt();
    Datum {
        latitude_deg: latitude.to_degrees(),
        longitude_deg: ecef.y.atan2(ecef.x).to_degrees(),
        altitude_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_goes_to_latitude_and_longitude_and_comes_back_within_a_tenth_of_a_millimeter() {
        for (latitude_deg, longitude_deg) in
            [(-33.6, -70.9), (0.0, 0.0), (51.2, 179.999), (89.9, 12.0), (-90.0, 0.0)]
        {
            let site = Datum { latitude_deg, longitude_deg, altitude_m: 432.1 };
            for enu in
                [Vector3::zeros(), Vector3::new(123.4, -56.7, 8.9), Vector3::new(-9_000.0, 4_000.0, 300.0)]
            {
                let back = site.offset_to(&site.offset(&enu));
                assert!((back - enu).norm() < 1e-7, "{site:?} {enu:?} {back:?}");
            }
        }
    }

    #[test]
    fn lengths_of_a_degree_are_those_of_the_ellipsoid() {
        // Meridian and equator arcs of WGS-84 at the equator: 110 574.3 m and 111 319.5 m for a whole degree;
        // for a hundredth of a degree the chord differs from the arc by less than 2 micrometers.
        let origin = Datum { latitude_deg: 0.0, longitude_deg: 0.0, altitude_m: 0.0 };
        let north = origin.offset_to(&Datum { latitude_deg: 0.01, ..origin });
        let east = origin.offset_to(&Datum { longitude_deg: 0.01, ..origin });
        assert!((north.y - 1_105.743).abs() < 1e-2, "{north:?}");
        assert!((east.x - 1_113.194_9).abs() < 1e-3, "{east:?}");
        assert!(north.x.abs() < 1e-9 && east.y.abs() < 1e-9);
    }
}
