//! The kinds of problem, each in a folder or file of its wing, and the one list of them. Variational inequalities stand in it among the complementarity problems, which they generalise: files, tables and reports state them by their parts as they state those.
//!
//! A line of [`list_of_kinds`](crate::list_of_kinds) makes [`Kind`]'s variant and its names, the variant of the wing's enum, the arms of
//! [`with_problem`](crate::with_problem) and the entry in all that is made by [`each_kind`](crate::each_kind).

pub mod complementarity;
pub mod contact;
pub mod variational;

use crate::{AnyProblem, OfAny};

/// The list of kinds, by wings. A line has the kind's documentation, its variant of [`Kind`](crate::Kind), its name in files, reports and the registry, its
/// variant of the wing's enum, its type, and the components of each contact (1 of pairs). It is handed on, after `$with`, to a macro.
#[doc(hidden)]
#[macro_export]
macro_rules! list_of_kinds {
    ($($then:tt)::+, $($with:tt)*) => {
        $($then)::+! {
            $($with)*
            /// Any of the frictional contact problems.
            Friction {
                /// `u = W r + q`, two-dimensional contacts.
                FrictionLocal2d, "friction_local_2d", Local2, $crate::FrictionLocal<2>, 2;
                /// `u = W r + q`, three-dimensional contacts.
                FrictionLocal3d, "friction_local_3d", Local3, $crate::FrictionLocal<3>, 3;
                /// `M v = H r + f`, `u = Hᵀ v + w`, two-dimensional contacts.
                FrictionGlobal2d, "friction_global_2d", Global2, $crate::FrictionGlobal<2>, 2;
                /// `M v = H r + f`, `u = Hᵀ v + w`, three-dimensional contacts.
                FrictionGlobal3d, "friction_global_3d", Global3, $crate::FrictionGlobal<3>, 3;
                /// `u = W r + q`, three-dimensional contacts with rolling friction.
                RollingLocal3d, "rolling_friction_local_3d", RollingLocal, $crate::RollingLocal, 5;
                /// `M v = H r + f`, `u = Hᵀ v + w`, three-dimensional contacts with rolling friction.
                RollingGlobal3d, "rolling_friction_global_3d", RollingGlobal, $crate::RollingGlobal, 5;
            }
            /// Any of the complementarity problems, and the variational inequality that they are cases of.
            Complementarity {
                /// `0 ≤ z ⟂ M z + q ≥ 0`.
                Lcp, "lcp", Lcp, $crate::Lcp, 1;
                /// An LCP with equalities and free variables.
                Mlcp, "mlcp", Mlcp, $crate::Mlcp, 1;
                /// `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0`.
                Hlcp, "hlcp", Hlcp, $crate::Hlcp, 1;
                /// `−(M z + q) ∈ N_[l, u](z)`.
                BoxLcp, "box_lcp", Box, $crate::BoxLcp, 1;
                /// `−F(x) ∈ N_[l, u](x)`.
                Mcp, "mcp", Mcp, $crate::Mcp, 1;
                /// `−F(x) ∈ N_X(x)`, X a box, a polyhedron, a ball, a second-order cone or a product of these.
                Vi, "vi", Vi, $crate::Vi, 1;
            }
        }
    };
}

/// What is made of the list: [`Kind`], the enums of the wings, and how a problem becomes one of [`AnyProblem`].
macro_rules! kinds {
    ($(
        $(#[$of_wing:meta])*
        $wing:ident {$(
            $(#[$doc:meta])*
            $kind:ident, $name:literal, $variant:ident, $type:ty, $dimension:literal;
        )*}
    )*) => {
        /// The kinds of problem, by the name that files, reports and the registry use.
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
        )]
        pub enum Kind {
            $($($(#[$doc])* #[serde(rename = $name)] $kind,)*)*
        }

        impl Kind {
            /// All kinds.
            pub const ALL: &'static [Self] = &[$($(Self::$kind),*),*];

            /// The name used in files, reports and on the command line.
            pub fn name(self) -> &'static str {
                match self { $($(Self::$kind => $name,)*)* }
            }

            /// The components D of each contact; 1 for the pairs of a complementarity problem.
            pub fn dimension(self) -> usize {
                match self { $($(Self::$kind => $dimension,)*)* }
            }
        }

        $(
            $(#[$of_wing])*
            #[derive(Debug, Clone, PartialEq)]
            pub enum $wing {
                $($(#[$doc])* $variant($type),)*
            }

            impl $wing {
                /// The kinds that it may hold.
                pub const KINDS: &'static [Kind] = &[$(Kind::$kind),*];
            }

            impl From<$wing> for AnyProblem {
                fn from(problem: $wing) -> Self {
                    Self::$wing(problem)
                }
            }

            $(
                impl From<$type> for AnyProblem {
                    fn from(problem: $type) -> Self {
                        Self::$wing($wing::$variant(problem))
                    }
                }

                impl OfAny for $type {
                    const KIND: Kind = Kind::$kind;
                }
            )*
        )*
    };
}

list_of_kinds!(kinds,);

impl Kind {
    /// Whether this is a complementarity problem or a variational inequality; the others are problems of frictional contact.
    pub fn is_complementarity(self) -> bool {
        Complementarity::KINDS.contains(&self)
    }
}

/// An array with the value of an expression for each kind of problem, in the order of [`Kind::ALL`](crate::Kind::ALL); its type goes by the name given:
/// `each_kind!(P => abouts::<P>())`. With `in Complementarity` after the name, for those of complementarity alone.
#[macro_export]
macro_rules! each_kind {
    ($P:ident => $value:expr) => {
        $crate::list_of_kinds!($crate::arms_of_kinds, all array $P => $value;)
    };
    ($P:ident in Complementarity => $value:expr) => {
        $crate::list_of_kinds!($crate::arms_of_kinds, complementarity array $P => $value;)
    };
}

/// Evaluates an expression for whichever problem a [`Friction`](crate::Friction) holds.
#[macro_export]
macro_rules! with_friction {
    ($any:expr, $problem:ident => $body:expr) => {
        $crate::list_of_kinds!($crate::arms_of_kinds, friction match $any, $problem => $body;)
    };
}

/// Evaluates an expression for whichever problem a [`Complementarity`](crate::Complementarity) holds.
#[macro_export]
macro_rules! with_complementarity {
    ($any:expr, $problem:ident => $body:expr) => {
        $crate::list_of_kinds!($crate::arms_of_kinds, complementarity match $any, $problem => $body;)
    };
}

/// Evaluates an expression for whichever problem an [`AnyProblem`](crate::AnyProblem) holds.
#[macro_export]
macro_rules! with_problem {
    ($any:expr, $problem:ident => $body:expr) => {
        match $any {
            $crate::AnyProblem::Friction(any) => $crate::with_friction!(any, $problem => $body),
            $crate::AnyProblem::Complementarity(any) => {
                $crate::with_complementarity!(any, $problem => $body)
            }
        }
    };
}

/// The elements of an array, or the arms of a match over one wing, from the list of kinds.
#[doc(hidden)]
#[macro_export]
macro_rules! arms_of_kinds {
    (
        all array $P:ident => $value:expr;
        $($(#[$of_wing:meta])* $wing:ident {$(
            $(#[$doc:meta])* $kind:ident, $name:literal, $variant:ident, $type:ty, $dimension:literal;
        )*})*
    ) => {
        [$($({ type $P = $type; $value }),*),*]
    };
    (
        complementarity array $P:ident => $value:expr;
        $(#[$of_other:meta])* Friction $others:tt
        $(#[$of_wing:meta])* Complementarity {$(
            $(#[$doc:meta])* $kind:ident, $name:literal, $variant:ident, $type:ty, $dimension:literal;
        )*}
    ) => {
        [$({ type $P = $type; $value }),*]
    };
    (
        friction match $any:expr, $problem:ident => $body:expr;
        $(#[$of_wing:meta])* Friction {$(
            $(#[$doc:meta])* $kind:ident, $name:literal, $variant:ident, $type:ty, $dimension:literal;
        )*}
        $($others:tt)*
    ) => {
        match $any { $($crate::Friction::$variant($problem) => $body,)* }
    };
    (
        complementarity match $any:expr, $problem:ident => $body:expr;
        $(#[$of_other:meta])* Friction $others:tt
        $(#[$of_wing:meta])* Complementarity {$(
            $(#[$doc:meta])* $kind:ident, $name:literal, $variant:ident, $type:ty, $dimension:literal;
        )*}
    ) => {
        match $any { $($crate::Complementarity::$variant($problem) => $body,)* }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_knows_names_wings_and_dimensions() {
        let kinds = each_kind!(P => P::KIND);
        assert_eq!(kinds, Kind::ALL);
        for kind in kinds {
            let json = serde_json::to_string(&kind).unwrap();
            assert_eq!(json, format!("\"{}\"", kind.name()));
            assert_eq!(serde_json::from_str::<Kind>(&json).unwrap(), kind);
            assert_eq!(kind.is_complementarity(), kind.dimension() == 1);
        }
        let names: std::collections::HashSet<_> = kinds.map(Kind::name).into();
        assert_eq!(names.len(), kinds.len());
    }
}
