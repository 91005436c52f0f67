//! What families of elastic solids share.

/// Declares the settings of a family of elastic solids: its own, then those of the material and its time integration,
/// then those common to all.
macro_rules! elastic_settings {
    (
        $(#[$doc:meta])*
        $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ty = $default:expr,)* }
    ) => {
        settings! {
            $(#[$doc])*
            $name {
                $($(#[$field_doc])* $field: $ty = $default,)*
                /// Young's modulus, Pa.
                young: f64 = 1e9,
                /// Poisson's ratio, between -1 and 0.5.
                poisson: f64 = 0.2,
                /// Damping in proportion to the mass, 1/s.
                alpha: f64 = 0.0,
                /// Damping in proportion to the stiffness, s.
                beta: f64 = 1e-4,
                /// Weight of the end of the step in the elastic forces, from 0.5 to 1.
                theta: f64 = 0.5,
                /// Masses at the nodes in place of the consistent mass matrix.
                lumped: bool = false,
            }
        }

        impl $name {
            /// A box of the material at rest, centred at `position`.
            fn solid(
                &self,
                sides: $crate::Vec3,
                elements: [usize; 3],
                position: $crate::Vec3,
            ) -> Result<$crate::ElasticBox, $crate::SceneError> {
                let Self { density, young, poisson, alpha, beta, theta, lumped, .. } = *self;
                let material = $crate::Material { density, young, poisson, alpha, beta };
                let solid = $crate::ElasticBox::new(sides, elements, material)?;
                let solid = $crate::ElasticBox { theta, lumped, position, ..solid };
                // Under the names of the settings.
                solid.validate("")?;
                Ok(solid)
            }
        }
    };
}

pub(super) use elastic_settings;
