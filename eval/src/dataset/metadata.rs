//! `metadata.yaml` of a rosbag2 directory, version 9 (Jazzy): written whole, read only for the names of its files.

use super::bag::Bag;
use super::error::{DatasetError, Place};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Name of the file inside the directory.
pub(super) const FILE_NAME: &str = "metadata.yaml";

/// One quality-of-service profile as YAML: reliable, and kept for late subscribers where `latched`.
pub(super) fn quality_of_service(latched: bool, indent: &str) -> String {
    let durability = if latched { "transient_local" } else { "volatile" };
    [
        "- history: keep_last".to_owned(),
        "  depth: 10".to_owned(),
        "  reliability: reliable".to_owned(),
        format!("  durability: {durability}"),
        "  deadline: {sec: 9223372036, nsec: 854775807}".to_owned(),
        "  lifespan: {sec: 9223372036, nsec: 854775807}".to_owned(),
        "  liveliness: automatic".to_owned(),
        "  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}".to_owned(),
        "  avoid_ros_namespace_conventions: false".to_owned(),
    ]
    .map(|line| format!("{indent}{line}"))
    .join("\n")
}

/// The text for a bag as it stands.
pub(super) fn text(bag: &Bag) -> String {
    let (first, last) = bag.bounds().unwrap_or_default();
    let messages: u64 = bag.channels().iter().map(|channel| channel.summary.messages).sum();
    let file = bag.path().file_name().unwrap_or_default().to_string_lossy();
    let file = quoted(&file);
    let duration = last - first;
    let mut yaml = format!(
        "rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  relative_file_paths:
    - {file}
  duration:
    nanoseconds: {duration}
  starting_time:
    nanoseconds_since_epoch: {first}
  message_count: {messages}
  topics_with_message_count:
"
    );
    for channel in bag.channels() {
        let topic = &channel.summary;
        let profile = quality_of_service(channel.latched, "          ");
        // Writing to a string cannot fail.
        let _ = write!(
            yaml,
            "    - topic_metadata:
        name: {name}
        type: {kind}
        serialization_format: cdr
        offered_qos_profiles:
{profile}
        type_description_hash: {hash}
      message_count: {count}
",
            name = topic.topic,
            kind = topic.message_type,
            hash = channel.type_hash,
            count = topic.messages,
        );
    }
    let _ = write!(
        yaml,
        "  compression_format: \"\"
  compression_mode: \"\"
  files:
    - path: {file}
      starting_time:
        nanoseconds_since_epoch: {first}
      duration:
        nanoseconds: {duration}
      message_count: {messages}
  custom_data: ~
  ros_distro: jazzy
"
    );
    yaml
}

/// The MCAP files of a rosbag2 directory in playing order: those that `metadata.yaml` names, else (a run that was
/// killed) every `*.mcap` in it by name.
pub(super) fn files(dir: &Path) -> Result<Vec<PathBuf>, DatasetError> {
    let metadata = dir.join(FILE_NAME);
    if !metadata.is_file() {
        return loose_files(dir);
    }
    let text = std::fs::read_to_string(&metadata).map_err(DatasetError::io(&metadata, "read"))?;
    let storage = text.lines().find_map(|line| line.trim().strip_prefix("storage_identifier:")).map(plain);
    if storage.as_deref() != Some("mcap") {
        return Err(DatasetError::content(
            &metadata,
            Place::Field("storage_identifier".to_owned()),
            storage.map_or("nothing".to_owned(), |found| format!("`{found}`")),
            "`mcap` (`ros2 bag convert` makes one)",
        ));
    }
    let mut lines = text.lines().skip_while(|line| line.trim() != "relative_file_paths:").skip(1);
    let files: Vec<PathBuf> = std::iter::from_fn(|| lines.next()?.trim().strip_prefix("- ").map(plain))
        .map(|name| dir.join(name))
        .collect();
    if files.is_empty() {
        return Err(DatasetError::content(
            &metadata,
            Place::Field("relative_file_paths".to_owned()),
            "no file",
            "the names of the MCAP files",
        ));
    }
    Ok(files)
}

fn loose_files(dir: &Path) -> Result<Vec<PathBuf>, DatasetError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(DatasetError::io(dir, "read"))? {
        let path = entry.map_err(DatasetError::io(dir, "read"))?.path();
        if path.extension().is_some_and(|extension| extension == "mcap") {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(DatasetError::whole(
            dir,
            "a directory without metadata.yaml and without *.mcap",
            "a rosbag2 directory with MCAP storage",
        ));
    }
    Ok(files)
}

fn plain(value: &str) -> String {
    value.trim().trim_matches(['"', '\'']).to_owned()
}

fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}
