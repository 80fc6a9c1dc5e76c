use crate::dataset::*;
use arborloop_base::{Observation, Sweep, Time};
use npyz::WriterBuilder;
use std::io::Write;
use std::path::{Path, PathBuf};

const BINS: u64 = 897;

/// Fields of a small file: name, shape, numbers.
type Fields = Vec<(&'static str, Vec<u64>, Vec<f64>)>;

fn fields() -> Fields {
    let ranges = (0..3 * BINS).map(|n| match n % 7 {
        0 => f64::INFINITY,
        1 => f64::NAN,
        2 => 0.0,
        _ => 0.5 + 0.01 * n as f64,
    });
    vec![
        ("scan0", vec![3, BINS], ranges.collect()),
        ("time", vec![3, 1], vec![1_691_337_600.25, 1_691_337_604.75, 1_691_337_609.5]),
        ("gnss_rotated_c", vec![3, 2], vec![0.0, 0.0, 0.25, 0.5, f64::NAN, 1.0]),
        ("u_var", vec![2, 2], vec![1.0, 2.0, 3.0, 4.0]),
        ("pose_robot", vec![3, 3], vec![9.0; 9]),
    ]
}

fn write(path: &Path, fields: &Fields) {
    let mut archive = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, shape, numbers) in fields {
        archive.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).unwrap();
        let mut bytes = Vec::new();
        let mut array =
            npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut bytes).begin_nd().unwrap();
        array.extend(numbers.iter().copied()).unwrap();
        array.finish().unwrap();
        archive.write_all(&bytes).unwrap();
    }
    archive.finish().unwrap();
}

fn sweeps(path: &Path) -> Vec<Sweep> {
    let recording = open(path).unwrap();
    let observations = recording.observations().unwrap().map(|item| match item.unwrap() {
        Observation::Sweep(sweep) => sweep,
        other => panic!("a lidar-only file gave {other:?}"),
    });
    observations.collect()
}

fn refused(change: impl FnOnce(&mut Fields)) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.npz");
    let mut fields = fields();
    change(&mut fields);
    write(&path, &fields);
    let message = open(&path).and_then(|recording| recording.reference()).unwrap_err().to_string();
    assert!(message.contains("bad.npz"), "{message}");
    message
}

#[test]
fn scans_become_instant_planar_sweeps_with_bearings_and_ranges_as_given() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.npz");
    write(&path, &fields());
    let recording = open(&path).unwrap();
    assert_eq!((recording.name(), recording.kind()), ("run", RecordingKind::Pullally));
    assert_eq!(
        (recording.sweeps(), recording.base_from_lidar()),
        (Some(3), arborloop_base::Pose::identity())
    );
    let sweeps = sweeps(&path);
    assert_eq!(sweeps.len(), 3);
    assert_eq!(sweeps[1].start, Time::from_nanos(1_691_337_604_750_000_000));
    for (row, sweep) in sweeps.iter().enumerate() {
        assert_eq!((sweep.start, sweep.rings, sweep.returns.len()), (sweep.end, 1, 897));
        for (bin, one) in sweep.returns.iter().enumerate() {
            let n = row * 897 + bin;
            assert_eq!(one.range_m, (n % 7 > 2).then_some(0.5 + 0.01 * n as f64));
            // Every bin but the first lies inside the half-open turn as it is; -pi itself is written as pi.
            let bearing = -std::f64::consts::PI + 0.007 * bin as f64;
            assert_eq!(one.azimuth_rad, if bin == 0 { std::f64::consts::PI } else { bearing });
        }
    }
}

#[test]
fn the_reference_is_the_satellite_track_without_heading() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.npz");
    write(&path, &fields());
    let reference = open(&path).unwrap().reference().unwrap().unwrap();
    assert_eq!((reference.has_heading, reference.pose_time), (false, PoseTime::Instant));
    // The third scan has no position.
    assert_eq!(reference.trajectory.len(), 2);
    assert_eq!(reference.trajectory.poses()[1].1, arborloop_base::Pose::translation(0.25, 0.5, 0.0));
    write(&path, &fields()[..2].to_vec());
    assert!(open(&path).unwrap().reference().unwrap().is_none());
}

#[test]
fn only_scans_and_times_reach_the_observations() {
    let dir = tempfile::tempdir().unwrap();
    let (path, other) = (dir.path().join("run.npz"), dir.path().join("other.npz"));
    write(&path, &fields());
    let mut zeroed = fields();
    for (name, _, numbers) in &mut zeroed {
        if !matches!(*name, "scan0" | "time") {
            numbers.fill(0.0);
        }
    }
    write(&other, &zeroed);
    assert_eq!(sweeps(&path), sweeps(&other));
    // Not even their presence is needed.
    write(&other, &fields()[..2].to_vec());
    assert_eq!(sweeps(&path), sweeps(&other));
}

#[test]
fn a_refused_field_is_named_with_what_was_found_and_what_was_wanted() {
    let message = refused(|fields| drop(fields.remove(0)));
    assert!(message.contains("field `scan0`: found no readable `scan0`"), "{message}");
    assert!(message.contains("the file has time.npy, gnss_rotated_c.npy"), "{message}");
    assert!(refused(|fields| drop(fields.remove(1))).contains("field `time`: found no readable `time`"));
    let message = refused(|fields| fields[0].1 = vec![BINS, 3]);
    assert!(message.contains("`scan0`: found shape (897, 3); wanted shape (N, 897)"), "{message}");
    let message = refused(|fields| fields[0] = ("scan0", vec![0, BINS], vec![]));
    assert!(message.contains("found shape (0, 897); wanted shape (N, 897), N at least 1"), "{message}");
    let message = refused(|fields| fields[1] = ("time", vec![2], vec![1.0, 2.0]));
    assert!(message.contains("`time`: found shape (2); wanted shape (3,) or (3, 1)"), "{message}");
    let message = refused(|fields| fields[1].2[2] = 1_691_337_604.75);
    assert!(message.contains("at index 2; wanted times that strictly increase"), "{message}");
    assert!(
        refused(|fields| fields[1].2[1] = f64::NAN).contains("found NaN at index 1; wanted finite seconds")
    );
    assert!(refused(|fields| fields[1].2[2] = 1e300).contains("wanted finite seconds"));
    let message = refused(|fields| fields[2] = ("gnss_rotated_c", vec![2, 2], vec![0.0; 4]));
    assert!(message.contains("`gnss_rotated_c`: found shape (2, 2); wanted shape (3, 2)"), "{message}");
}

#[test]
fn a_broken_zip_or_array_is_an_error_not_a_panic() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.npz");
    write(&path, &fields());
    let whole = std::fs::read(&path).unwrap();
    for share in 0..16 {
        std::fs::write(&path, &whole[..whole.len() * share / 16]).unwrap();
        assert!(open(&path).unwrap_err().to_string().contains("bad.npz"));
    }
    let stream = arborloop_base::Seed(9).stream("garble");
    for round in 0..60 {
        let mut bytes = whole.clone();
        let at = (stream.at(round).unit() * bytes.len() as f64) as usize;
        bytes[at] ^= 1 << (round % 8);
        std::fs::write(&path, &bytes).unwrap();
        let _ = open(&path).and_then(|recording| recording.reference());
    }
}

#[test]
fn the_authors_own_files_are_read_whole() {
    let data = std::env::var_os("ARBORLOOP_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    for (file, scans) in [("run1.npz", 546), ("run2.npz", 555)] {
        let path = data.join("pullally").join(file);
        if !path.is_file() {
            eprintln!("skipped: {} is absent (set ARBORLOOP_DATA)", path.display());
            continue;
        }
        let sweeps = sweeps(&path);
        assert_eq!(sweeps.len(), scans);
        let misses =
            sweeps.iter().flat_map(|sweep| &sweep.returns).filter(|one| one.range_m.is_none()).count();
        // The published share of `inf`: 2.5 and 1.7 percent.
        let share = misses as f64 / (scans * 897) as f64;
        assert!((0.016..0.026).contains(&share), "{share}");
        let reference = open(&path).unwrap().reference().unwrap().unwrap();
        assert_eq!(reference.trajectory.len(), scans);
        assert!((150.0..152.0).contains(&reference.trajectory.length_m()));
    }
}
