//! Contact problems: whether a solution exists, what is said of them and advised, friction through facets, Newton's and proximal methods, interior points, the methods through convex
//! optimisation, `auto`, scalar rows with bounds, rolling friction, a law of one's own.
//!
//! What asks the registry stands here and not beside the sources: every solver is then compiled once, in the library.

mod another_law;
mod auto;
mod diagnosis;
mod existence;
mod facets;
mod interior;
mod ncp;
mod newton;
mod optimisation;
mod plain_lemke;
mod proximal;
mod registered;
mod rolling;
mod scalar_rows;
