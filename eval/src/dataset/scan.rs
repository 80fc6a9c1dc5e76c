//! A planar sweep as `sensor_msgs/LaserScan`: one range per bearing, `+inf` for a miss (REP-117).

use super::error::Refusal;
use super::ros2::{Header, LaserScan};
use arborloop_base::{Return, Span, Sweep, Time, wrap_angle};

/// Bearings may differ from even spacing by this, radians.
const BEARING_TOLERANCE_RAD: f64 = 1e-6;

/// A scan that claims to last longer than this has its times wrong, seconds.
const LASTS_S_MAX: f64 = 1e6;

/// The scan of a planar sweep whose bearings are evenly spaced; stamped with its start.
pub(super) fn message_of(sweep: &Sweep, frame: &str) -> Result<LaserScan, Refusal> {
    let wanted = "a planar sweep of evenly spaced bearings";
    let [first, second, ..] = sweep.returns.as_slice() else {
        return Err(Refusal::new(format!("a planar sweep of {} returns", sweep.returns.len()), wanted));
    };
    let increment_rad = wrap_angle(second.azimuth_rad - first.azimuth_rad);
    for (index, one) in sweep.returns.iter().enumerate() {
        let even = first.azimuth_rad + increment_rad * index as f64;
        if wrap_angle(one.azimuth_rad - even).abs() > BEARING_TOLERANCE_RAD {
            return Err(Refusal::new(format!("bearing {} rad of return {index}", one.azimuth_rad), wanted));
        }
    }
    // A first bearing of pi is the -pi of a full turn that counts upward.
    let turn = increment_rad.abs() * (sweep.returns.len() - 1) as f64;
    let angle_min = if first.azimuth_rad + increment_rad.signum() * turn > std::f64::consts::TAU {
        first.azimuth_rad - std::f64::consts::TAU
    } else {
        first.azimuth_rad
    };
    let ranges = sweep.returns.iter().map(|one| one.range_m.map_or(f32::INFINITY, |range_m| range_m as f32));
    Ok(LaserScan {
        header: Header::new(sweep.start, frame)?,
        angle_min: angle_min as f32,
        angle_max: (angle_min + increment_rad.signum() * turn) as f32,
        angle_increment: increment_rad as f32,
        time_increment: (second.fired_after - first.fired_after).seconds() as f32,
        scan_time: (sweep.end - sweep.start).seconds() as f32,
        range_min: 0.0,
        range_max: f32::MAX,
        ranges: ranges.collect(),
        intensities: sweep.returns.iter().map(|one| one.intensity).collect(),
    })
}

/// The sweep of a scan: instant unless the scan says how long it took; `end` where the recorder promises it.
/// Ranges outside the scan's own limits, infinite or NaN are misses.
pub(super) fn sweep_of(scan: &LaserScan, end: Option<Time>) -> Result<Sweep, Refusal> {
    let numbers = [scan.angle_min, scan.angle_increment, scan.time_increment, scan.scan_time];
    let step_s = f64::from(scan.time_increment);
    let lasts_s = step_s * scan.ranges.len().saturating_sub(1) as f64;
    if !numbers.iter().all(|number| number.is_finite()) || !(0.0..LASTS_S_MAX).contains(&lasts_s) {
        return Err(Refusal::new(
            format!("angles and times {numbers:?}"),
            "finite angles and a time increment from zero up",
        ));
    }
    let start = scan.header.stamp.time();
    let mut sweep = Sweep {
        start,
        end: end.unwrap_or(start + Span::from_seconds(lasts_s)).max(start),
        ..Sweep::default()
    };
    sweep.rings = 1;
    sweep.returns.extend(scan.ranges.iter().enumerate().map(|(index, range)| {
        let hit = range.is_finite() && *range > 0.0 && (scan.range_min..=scan.range_max).contains(range);
        Return {
            azimuth_rad: wrap_angle(
                f64::from(scan.angle_min) + f64::from(scan.angle_increment) * index as f64,
            ),
            elevation_rad: 0.0,
            range_m: hit.then(|| f64::from(*range)),
            ring: 0,
            number: 0,
            fired_after: Span::from_seconds(step_s * index as f64),
            intensity: scan.intensities.get(index).copied().unwrap_or_default(),
        }
    }));
    Ok(sweep)
}
