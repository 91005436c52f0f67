//! What every Newton method of the family does.
