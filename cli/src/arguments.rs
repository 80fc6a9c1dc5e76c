//! The command line.

use arborloop_eval::{Alignment, PoseTime};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Simulation-in-the-loop tests for lidar SLAM in orchards and forests.
#[derive(Debug, Parser)]
#[command(name = "arborloop", version, arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) verb: Verb,
    /// No progress on standard error.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Threads for casting rays and for the runs of a suite; all cores when absent. Results do not depend on it.
    #[arg(long, global = true, value_name = "N")]
    pub(crate) threads: Option<usize>,
    /// How results are printed on standard output.
    #[arg(long, global = true, value_enum, default_value_t = Format::Human)]
    pub(crate) format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// A table.
    Human,
    /// What metrics.json holds.
    Json,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Run one scenario: world, robot, sensors, SLAM, metrics, verdict, report.
    Run(Run),
    /// Run a suite in parallel; exit code 100 when an expectation fails.
    Test(Test),
    /// Make a data set with exact truth, no SLAM.
    Gen(Gen),
    /// Feed a recording to SLAM systems: a run's folder, rosbag2/MCAP, the authors' Pullally .npz.
    Replay(Replay),
    /// Score a trajectory (TUM) or a map (map_server YAML) against a reference.
    Eval(Eval),
    /// Say what one beam of a run met, and why it returned or not.
    Explain(Explain),
    /// Check scenario and suite files without running them.
    Check {
        /// Files, or names of what comes with the program.
        #[arg(required = true)]
        files: Vec<String>,
    },
    /// Show a scenario with every default spelled out, pictures of its world, a lidar's data file, or a robot's tree and
    /// masses.
    Show(Show),
    /// What comes with the program.
    List,
}

#[derive(Debug, Args)]
pub(crate) struct Run {
    /// Name of an embedded scenario, or a file.
    pub(crate) scenario: String,
    /// Seed; the scenario's own when absent.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Put a value over the scenario's, for instance lidar.dropout_ratio=0.3; may repeat.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Systems under test; may repeat.
    #[arg(long = "system", value_name = "NAME", default_values_t = ["mhd".to_owned(), "mhd-paper".to_owned(), "still".to_owned()])]
    pub(crate) systems: Vec<String>,
    /// Who steers: truth, or one of the systems.
    #[arg(long, default_value = "mhd")]
    pub(crate) driver: String,
    /// What must hold, for instance mhd.position_mean_m<=0.05; may repeat.
    #[arg(long, value_name = "SYSTEM.METRIC<=NUMBER", value_parser = crate::expect::Expect::parse)]
    pub(crate) expect: Vec<crate::expect::Expect>,
    /// Folder of the run; runs/<name>/<seed> when absent.
    #[arg(short, long)]
    pub(crate) output: Option<PathBuf>,
    /// Make no recording: no content hash, nothing to replay, much less to write.
    #[arg(long)]
    pub(crate) no_recording: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Test {
    /// Name of an embedded suite, or a file.
    #[arg(default_value = "smoke")]
    pub(crate) suite: String,
    /// Run only what has this in its name.
    #[arg(long)]
    pub(crate) filter: Option<String>,
    /// At most so many seeds of each case, the first ones.
    #[arg(long, value_name = "COUNT")]
    pub(crate) seeds: Option<usize>,
    /// Folder of the suite's results; runs/<suite> when absent.
    #[arg(short, long)]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Gen {
    /// Name of an embedded scenario, or a file.
    pub(crate) scenario: String,
    /// Seed; the scenario's own when absent.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Put a value over the scenario's; may repeat.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Folder of the data set; must not exist yet.
    #[arg(short, long)]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Replay {
    /// A rosbag2 folder, an .mcap file, or a Pullally .npz.
    pub(crate) recording: PathBuf,
    /// Systems under test; may repeat.
    #[arg(long = "system", value_name = "NAME", default_values_t = ["mhd".to_owned(), "still".to_owned()])]
    pub(crate) systems: Vec<String>,
    /// What must hold; may repeat.
    #[arg(long, value_name = "SYSTEM.METRIC<=NUMBER", value_parser = crate::expect::Expect::parse)]
    pub(crate) expect: Vec<crate::expect::Expect>,
    /// Folder of the replay; runs/replay-<name>/0 when absent.
    #[arg(short, long)]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Explain {
    /// Folder of a run or of a data set.
    pub(crate) run: PathBuf,
    /// Which sweep, counted from 0.
    #[arg(long, value_name = "N")]
    pub(crate) sweep: u64,
    /// Which firing of the sweep, counted from 0 in firing order.
    #[arg(long, value_name = "K")]
    pub(crate) ray: usize,
}

#[derive(Debug, Args)]
pub(crate) struct Eval {
    /// The reference: a TUM trajectory or a map's YAML.
    pub(crate) reference: PathBuf,
    /// The estimate, of the same kind.
    pub(crate) estimate: PathBuf,
    /// How the trajectory is laid over the reference.
    #[arg(long, value_parser = alignment, default_value = "none")]
    pub(crate) alignment: Alignment,
    /// The instant of a sweep to which the poses of both files belong: sweep_start, sweep_end or instant. Never guessed.
    #[arg(long, value_parser = pose_time)]
    pub(crate) pose_time: Option<PoseTime>,
    /// The reference has no headings.
    #[arg(long)]
    pub(crate) no_heading: bool,
    /// Maps: how far apart two cells may be and still be the same place, meters.
    #[arg(long, default_value_t = 0.1)]
    pub(crate) tolerance_m: f64,
}

#[derive(Debug, Args)]
pub(crate) struct Show {
    #[command(subcommand)]
    pub(crate) what: Shown,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Shown {
    /// A scenario with every default spelled out.
    Scenario {
        /// Name of an embedded scenario, or a file.
        scenario: String,
        /// Put a value over the scenario's; may repeat.
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,
    },
    /// Pictures of a scenario's world: from above, from behind the robot, and one sweep of its lidar.
    World {
        /// Name of an embedded scenario, or a file.
        scenario: String,
        /// Seed; the scenario's own when absent.
        #[arg(long)]
        seed: Option<u64>,
        /// Put a value over the scenario's; may repeat.
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,
        /// Folder for top.png, view.png and sweep.png; made if it is missing.
        #[arg(short, long)]
        output: PathBuf,
    },
    /// A lidar's beams, turn, pulse and range: a data file to start one's own from.
    Lidar {
        /// Name of a lidar that comes with the program, or a file to check.
        #[arg(default_value = "vlp16")]
        lidar: String,
    },
    /// A robot's links, joints, masses and sensor frames, and whether it has legs or wheels that this program can move.
    Robot {
        /// A URDF file, or one of go1, jackal and thorvald.
        #[arg(default_value = "go1")]
        robot: String,
        /// Where the meshes of a package are, for package://PACKAGE/...; may repeat.
        #[arg(long = "mesh", value_name = "PACKAGE=FOLDER", value_parser = package)]
        meshes: Vec<(String, PathBuf)>,
    },
}

fn package(text: &str) -> Result<(String, PathBuf), String> {
    let (name, folder) =
        text.split_once('=').ok_or_else(|| format!("found `{text}`, wanted PACKAGE=FOLDER"))?;
    Ok((name.to_owned(), PathBuf::from(folder)))
}

fn alignment(text: &str) -> Result<Alignment, String> {
    word(text)
}

fn pose_time(text: &str) -> Result<PoseTime, String> {
    word(text)
}

fn word<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    serde_json::from_value(serde_json::Value::String(text.replace('-', "_")))
        .map_err(|error| error.to_string())
}
