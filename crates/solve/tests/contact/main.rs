//! Contact problems: whether a solution exists, friction through facets, the methods through convex optimisation.

mod existence;
mod facets;
mod optimisation;
mod plain_lemke;
