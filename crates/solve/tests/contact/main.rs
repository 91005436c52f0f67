//! Contact problems: whether a solution exists, friction through facets, the methods through convex optimisation, scalar rows with bounds, rolling friction, a law of one's own.

mod another_law;
mod existence;
mod facets;
mod ncp;
mod optimisation;
mod plain_lemke;
mod rolling;
mod scalar_rows;
