//! What the judges of contacts share: the law from its definition, the loads, the impulses that refute a problem.

mod contact;
pub(super) mod gauge;
mod impulses;
pub(super) mod loads;
mod rolling;
pub(super) mod statement;
pub(super) mod weighed;

pub use contact::{ContactStatus, Law, Motion};
pub use impulses::Impulses;
pub(super) use impulses::holds;
pub use statement::friction_rows;
pub use weighed::Weighed;
