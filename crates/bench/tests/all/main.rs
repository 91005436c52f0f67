//! Runs, profiles, comparisons and reports.
//!
//! One program, since each that is linked compiles what is generic again, and tests of one program run side by side.

#[path = "../browser/mod.rs"]
mod browser;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod foreign;
mod mutations;
mod profiles;
mod report;
