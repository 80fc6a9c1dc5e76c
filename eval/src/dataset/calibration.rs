//! `calib.yaml`: where the sensors sit and the lidar's own table, for people and for tools that want it as text.

use super::error::DatasetError;
use super::recorder::RecorderSettings;
use arborloop_base::{Pose, Wire, vlp16};
use std::fmt::Write;
use std::path::Path;

/// Writes `calib.yaml` into a directory.
pub fn write_calibration(dir: &Path, settings: &RecorderSettings) -> Result<(), DatasetError> {
    let path = dir.join("calib.yaml");
    std::fs::write(&path, text(settings)).map_err(DatasetError::io(&path, "write"))
}

fn text(settings: &RecorderSettings) -> String {
    let datum = &settings.datum;
    let mut yaml = format!(
        "# Mounts: base_from_sensor; a point p in the sensor's frame is base_from_sensor * p on the base.\n\
         # Translations in meters, quaternions as x, y, z, w. Frames follow REP-103.\n\
         datum: {{latitude_deg: {}, longitude_deg: {}, altitude_m: {}}}\nmounts:\n",
        datum.latitude_deg, datum.longitude_deg, datum.altitude_m
    );
    mount(&mut yaml, &settings.lidar_frame, &settings.base_from_lidar);
    mount(&mut yaml, "imu_link", &settings.base_from_imu);
    mount(&mut yaml, "gps_link", &settings.base_from_antenna);
    match &settings.wire {
        Wire::Vlp16(_) => vlp16_table(&mut yaml, &settings.lidar_frame),
        Wire::Ouster(sensor) => {
            // Writing to a string cannot fail.
            let _ = write!(
                yaml,
                "lidar:\n  frame: {}\n  model: OS1\n  columns: {}\n  turn_ns: {}\n  beam_radius_m: {}\n\
                 \x20 # One line per beam from the highest down; azimuths clockwise of the encoder's bearing.\n  beams:\n",
                settings.lidar_frame,
                sensor.columns,
                sensor.turn.nanos(),
                sensor.beam_radius_m,
            );
            for (elevation_deg, azimuth_deg) in sensor.altitude_deg.iter().zip(&sensor.azimuth_deg) {
                let _ =
                    writeln!(yaml, "    - {{elevation_deg: {elevation_deg}, azimuth_deg: {azimuth_deg}}}");
            }
        }
        Wire::Plain => {
            let frame = &settings.lidar_frame;
            let _ = write!(
                yaml,
                "lidar:\n  frame: {frame}\n  # The lidar's table stands in scenario.resolved.toml.\n"
            );
        }
    }
    yaml
}

fn vlp16_table(yaml: &mut String, frame: &str) {
    // Writing to a string cannot fail.
    let _ = write!(
        yaml,
        "lidar:\n  frame: {}\n  model: VLP-16\n  laser_step_ns: {}\n  cycle_step_ns: {}\n  distance_step_m: {}\n\
         \x20 # One line per laser in firing order (manual 63-9243 Rev D, p. 54).\n  lasers:\n",
        frame,
        vlp16::LASER_STEP.nanos(),
        vlp16::CYCLE_STEP.nanos(),
        vlp16::DISTANCE_STEP_M,
    );
    for laser in 0..vlp16::LASERS {
        let _ = writeln!(
            yaml,
            "    - {{ring: {}, elevation_deg: {:.1}, vertical_offset_m: {:.4}}}",
            vlp16::ring_of(laser),
            vlp16::ELEVATION_DEG[laser],
            vlp16::OFFSET_M[laser],
        );
    }
}

fn mount(yaml: &mut String, frame: &str, base_from_sensor: &Pose) {
    let (p, q) = (&base_from_sensor.translation, &base_from_sensor.rotation);
    // Writing to a string cannot fail.
    let _ = writeln!(
        yaml,
        "  {frame}:\n    translation_m: [{}, {}, {}]\n    rotation_xyzw: [{}, {}, {}, {}]",
        p.x, p.y, p.z, q.i, q.j, q.k, q.w
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mounts_and_all_sixteen_lasers_are_written() {
        let settings = RecorderSettings {
            base_from_lidar: Pose::translation(0.1, 0.0, 0.25),
            ..RecorderSettings::default()
        };
        let yaml = text(&settings);
        assert!(yaml.contains("  velodyne:\n    translation_m: [0.1, 0, 0.25]\n"), "{yaml}");
        assert!(
            yaml.contains("    - {ring: 0, elevation_deg: -15.0, vertical_offset_m: 0.0112}\n"),
            "{yaml}"
        );
        assert_eq!(yaml.matches("- {ring: ").count(), 16);
    }
}
