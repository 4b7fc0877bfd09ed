//! What every bench does: how often and over which DEMs its arguments ask for, and the median of what it timed.
#![allow(unreachable_pub, reason = "a module of benches has no outside")]
#![allow(dead_code, reason = "each bench uses its own part of this")]

use clipscape::stats;

/// The arguments `[ROUNDS] [DEM...]`; without a DEM, the shipped one and `also`.
pub fn rounds_and_dems(rounds: usize, also: &str) -> (usize, Vec<String>) {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench").peekable();
    let given = arguments.peek().and_then(|a| a.parse().ok());
    if given.is_some() {
        arguments.next();
    }
    let named: Vec<String> = arguments.collect();
    let dems = if named.is_empty() {
        ["data/N42E001.hgt", also].map(String::from).to_vec()
    } else {
        named
    };
    (given.unwrap_or(rounds), dems)
}

pub fn percentile(values: &[f64], percent: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    stats::percentile(&sorted, percent)
}

pub fn median(values: &[f64]) -> f64 {
    percentile(values, 50.0)
}
