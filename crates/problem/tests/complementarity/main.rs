//! Linear complementarity problems: their judge, and the planted ones.

mod judge;
mod planted;
mod scaling;
