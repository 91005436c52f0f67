//! Contact problems: their judge, and the operator W.

mod delassus;
mod judge;
