//! Campaigns: problems × solvers × tolerances, each run in a process of its own.
//!
//! A [`Setup`] says what to run. [`run`] has every problem described by a worker process, then every run done by another,
//! so that a crash, an endless loop or a run that eats the memory costs that run and nothing else; each result is
//! appended to the [`Journal`] before the next begins. The worker is whatever program calls [`serve`]: tests bring solvers that
//! abort, panic, hang, eat memory and lie.
//!
//! A worker gets one job on its standard input and says on its standard output how far it is. It is ended when it is silent beyond its time limit and a
//! grace, limits its own address space, and ends itself when its standard input closes, so that `kill -9` of the campaign leaves no orphans. On Linux it is
//! started from `/proc/self/exe`: a campaign is one program even if its file is replaced meanwhile.

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
pub use journal::{Journal, unused};
pub use pool::{Event, Setup, Summary, run};
pub use solvers::{Label, Registry, Solvers};
pub use system::machine;
pub use worker::serve;
