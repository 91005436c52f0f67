//! Files of all formats: what is read, written and refused.
//!
//! One program, since each that is linked compiles what is generic again, and tests of one program run side by side.

#[path = "../common/mod.rs"]
mod common;
mod corpus;
mod damage;
mod eyes;
mod format;
mod linear;
mod mechanics;
#[path = "../motion/mod.rs"]
mod motion;
mod mutations;
mod nl;
mod round_trip;
mod trajectory;
