//! The product's own regression suite: whole runs through the public interfaces of all members.

// Everything here is a test: a failed unwrap is a failed test. Clippy knows that of `#[test]` functions only.
#![allow(clippy::unwrap_used)]

mod architecture;
mod check;
mod closed_loop;
mod dataset;
mod degraded;
mod determinism;
mod hedges;
mod real_data;
mod real_lidars;
mod scenario;
mod wind;
