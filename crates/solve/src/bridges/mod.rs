//! From contact to complementarity: the one place that sees both of these wings.

mod facets;
mod kept;
mod ncp;

pub use facets::{FacetInner, FacetOuter, Facets, InnerMemo, OuterMemo};
pub use ncp::{AsNcp, First, Formulation, Glocker, Law, NcpMemo, Slot};
