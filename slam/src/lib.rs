//! The SLAM systems that arborloop ships: `mhd`, `mhd-paper`, the baseline `aloam` and the floors `icp2d` and
//! `still`.
//!
//! A system is given observations and nothing else. Every system answers every sweep with the pose of the base
//! at the sweep's end, in a map whose origin is the base at the end of the first sweep.

mod aloam;
mod catalog;
mod icp2d;
mod kbest;
mod kdtree;
mod mhd;
mod paper;
mod raster;
mod rig;
mod still;

pub use aloam::settings::AloamSettings;
pub use catalog::{BuildError, NAMES, build, build_default};
pub use icp2d::settings::Icp2dSettings;
pub use mhd::settings::MhdSettings;
pub use paper::settings::MhdPaperSettings;
pub use rig::Rig;
pub use still::StillSettings;
