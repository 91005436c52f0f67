//! Linear complementarity problems, family by family.

mod common;
mod existence;
mod functions;
mod guarantees;
mod interior;
mod lemke;
mod multistart;
mod newton;
mod patience;
mod pivoting;
mod presolve;
mod reform;
mod refuted;
mod splitting;
mod truth;
