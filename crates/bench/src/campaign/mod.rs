//! Campaigns: problems × solvers × tolerances, each run in a process of its own.
//!
//! A [`Setup`] says what to run. [`run`] has every problem described by a worker process, then every run done by another,
//! so that a crash, an endless loop or a run that eats the memory costs that run and nothing else; each result is
//! appended to the [`Journal`] before the next begins. The worker is whatever program calls [`serve`].

mod child;
mod files;
mod job;
mod journal;
mod pool;
mod solvers;
mod system;
mod worker;

pub use child::WorkerCommand;
pub use files::{Input, describe, inputs};
pub use job::{Job, Said, Task};
pub use journal::Journal;
pub use pool::{Event, Setup, Summary, run};
pub use solvers::{Label, Registry, Solvers};
pub use system::machine;
pub use worker::serve;
