//! From contact to complementarity: the one place that sees both wings.

mod facets;

pub use facets::{FacetInner, FacetOuter, Facets, InnerMemo, OuterMemo};
