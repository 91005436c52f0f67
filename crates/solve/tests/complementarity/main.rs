//! Linear complementarity problems, family by family.

mod common;
mod functions;
mod guarantees;
mod interior;
mod lemke;
mod newton;
mod pivoting;
mod reform;
mod splitting;
mod truth;
