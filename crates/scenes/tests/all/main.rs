//! Scenes, their problems, and their pictures.
//!
//! One program, since each that is linked compiles what is generic again, and tests of one program run side by side.

mod assembly;
// Of the browser's functions this needs a few.
#[allow(dead_code)]
#[path = "../../../bench/tests/browser/mod.rs"]
mod browser;
mod drawing;
mod elastic;
mod families;
#[path = "../motion/mod.rs"]
mod motion;
mod page;
mod playback;
mod scenes;
mod turning_ball;
