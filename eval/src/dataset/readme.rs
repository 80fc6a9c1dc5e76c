//! `DATASET.md`: what lies in a data set's directory and how the usual tools open it.

use super::error::DatasetError;
use super::manifest::Manifest;
use std::fmt::Write;
use std::path::Path;

/// Writes `DATASET.md` into a directory.
pub fn write_readme(dir: &Path, manifest: &Manifest) -> Result<(), DatasetError> {
    let path = dir.join("DATASET.md");
    std::fs::write(&path, text(manifest)).map_err(DatasetError::io(&path, "write"))
}

fn text(manifest: &Manifest) -> String {
    let Manifest { name, seed, tool_version, content_sha256, scenario_sha256, units, .. } = manifest;
    let mut page = format!(
        "# {name}\n\n\
         A simulated recording with exact truth, made by arborloop {tool_version} with seed {seed}.\n\n\
         | | |\n|---|---|\n\
         | content (SHA-256 over topic, log time, payload) | `{content_sha256}` |\n\
         | scenario (SHA-256 of `scenario.resolved.toml`) | `{scenario_sha256}` |\n\
         | duration | {:.3} s |\n\
         | units | {units} |\n\n\
         ## Topics\n\n| topic | type | messages |\n|---|---|---|\n",
        manifest.duration_ns as f64 * 1e-9
    );
    for topic in &manifest.topics {
        // Writing to a string cannot fail.
        let _ = writeln!(page, "| `{}` | {} | {} |", topic.topic, topic.message_type, topic.messages);
    }
    page.push_str(NOTES);
    page.push_str("\n## Frames\n\n| frame | meaning |\n|---|---|\n");
    for (frame, meaning) in &manifest.frames {
        let _ = writeln!(page, "| `{frame}` | {meaning} |");
    }
    page.push_str(FILES);
    let _ = write!(
        page,
        "\n## Opening it\n\n```sh\n\
         kiss_icp_pipeline {name}   # pip install kiss-icp\n\
         evo_ape tum {name}/gt/gt_base_link.tum estimate.tum --align   # pip install evo\n\
         evo_traj bag2 {name} /ground_truth/pose\n\
         ros2 bag play {name}\n\
         arborloop replay {name}\n```\n\n\
         ```python\n\
         from pathlib import Path\n\
         from rosbags.highlevel import AnyReader   # pip install rosbags\n\
         with AnyReader([Path(\"{name}\")]) as reader:\n\
         \x20   for connection, log_time, payload in reader.messages():\n\
         \x20       message = reader.deserialize(payload, connection.msgtype)\n\
         ```\n"
    );
    page
}

const NOTES: &str = "
- A sweep is logged at the exact instant at which it is complete; other topics of the same instant stand some
  nanoseconds beside it, in the order in which they were delivered. Log times are unique and strictly increase.
- `/velodyne_points` holds hits only, in firing order (`x y z intensity ring time`, 22 bytes a point, ring 0 lowest,
  `time` in seconds after the stamp, which is the end of the sweep unless the recording says otherwise).
  `/velodyne_packets` holds the same sweeps as the sensor's own packets, misses included.
- An OS1 is recorded as `/ouster/points` in ouster-ros's layout, organized, a miss at the origin, ring 0 highest, stamped
  with its first column; `/ouster/metadata` is its metadata. Intensity and reflectivity are the same number here.
- Any other lidar is recorded as `/lidar/points`: coordinates, and the exact polar numbers of every return; a miss
  stands at the origin; the stamp is the end of the sweep and `t` counts nanoseconds from it.
- `gt/labels` is a recording of its own with the one topic `/ground_truth/labels`: one entry per point of the cloud of
  the same log time, in the same order: class (0 sky, 1 ground, 2 grass, 3 trunk, 4 branch, 5 leaf, 6 cone, 7 post,
  8 wire, 9 robot, 10 rain, fog or dust), number of the return within its firing, mixed (1 where several surfaces share the
  return), instance, true range, incidence angle, displacement of the surface by the wind.
- `/ground_truth/pose` and `/ground_truth/odom` are in the frame `world`, at 200 Hz and at every sweep's end.
  Truth is on topics only, never in `/tf`. `/ground_truth/contacts` speaks when the set of contacts changes.
- `/odom` carries the twist that the robot believes it executed; its pose is the integral of that.
- `/slam/<system>/...` is what a system answered: names are written with `_` where ROS allows no other sign.
- A covariance of all zeros in an odometry message means: not known. Systems estimate no twist: it is zero there.
- `/gps/fix` status: 2 carrier phase fixed, 1 float, 0 single point, -1 none.
";

const FILES: &str = "
## Files

| file | content |
|---|---|
| `gt/gt_base_link.tum` | `base_link` in the frame `start`, at the end of every sweep: score estimates against this |
| `gt/gt_lidar.tum`, `gt/gt_lidar_scan_end.tum` | the lidar in the frame `start`, at the end of every sweep |
| `gt/gt_lidar_scan_start.tum` | the lidar in the frame `start`, at the first firing of every sweep |
| `gt/gt_200hz.tum` | `base_link` in the frame `start`, 200 Hz |
| `gt/labels/` | what every point of the clouds really met, a rosbag2 directory |
| `calib.yaml` | mounts and the lidar's table |
| `manifest.json` | hashes, seed, frames, topics |

Stamps of poses name their instant. Scan start against scan end alone makes centimeters of error on a walking robot.
";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Recorded;
    use arborloop_base::Span;

    #[test]
    fn the_page_names_the_recording_its_hashes_and_its_frames() {
        let recorded = Recorded {
            content_hash: "c0ffee".to_owned(),
            labels_hash: None,
            messages: 0,
            duration: Span::from_millis(1500),
            topics: Vec::new(),
        };
        let page = text(&Manifest::new("cones-s42", 42, "", &recorded));
        for part in ["# cones-s42", "`c0ffee`", "seed 42", "1.500 s", "| `map` |", "evo_traj bag2 cones-s42"]
        {
            assert!(page.contains(part), "{part} is missing in\n{page}");
        }
    }
}
