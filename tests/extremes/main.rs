//! The extremes: every line of the design's list that a clipmap owes, as tests. Each draws small frames where there is
//! an adapter, and checks the facts about alpha, that all numbers are finite, and that culling changes no bit.
//!
//! Largest differences, where something is compared with a tolerance, are printed: `cargo test --test extremes --
//! --nocapture`.
#![allow(clippy::print_stdout, reason = "the largest differences found are printed")]

#[path = "../support/mod.rs"]
mod support;

#[cfg(feature = "gpu")]
mod culling;
#[cfg(feature = "gpu")]
mod draw;
mod eyes;
mod harness;
mod heights;
mod motion;
#[cfg(feature = "gpu")]
mod precision;
mod sizes;
mod views;
