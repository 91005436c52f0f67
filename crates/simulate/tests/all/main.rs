//! Worlds, their files, and motions against what is known of them.
//!
//! One program, since each that is linked compiles what is generic again, and tests of one program run side by side.

mod import;
mod lagrangian;
mod mjcf;
mod scene_file;
mod statistics;
mod verification;
