//! Given contacts.

use crate::SceneError;
use crate::error::require;
use crate::vec3::{Vec3, X, Y, cross, dot, norm, normalise, scale, sub};

/// A contact point at which body `b` may push on body `a`, or on the ground.
///
/// The local frame is `[N, T1, T2]`, right-handed; the relative velocity is that of b seen from a, so that
/// `u_N > 0` separates, and the impulse r acts on b (−r on a).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The first body or, counted after the bodies, elastic solid; `None` for the ground.
    pub a: Option<usize>,
    /// The second body or elastic solid.
    pub b: usize,
    /// Where they touch, m.
    pub point: Vec3,
    /// From a to b; need not be of unit length.
    pub normal: Vec3,
    /// Any direction across the normal; its part orthogonal to the normal gives T1.
    pub tangent: Vec3,
    /// Coefficient of friction.
    pub mu: f64,
    /// Coefficient of rolling friction, m; 0: none.
    pub mu_r: f64,
    /// Newton's coefficient of restitution, from 0 to 1.
    pub e: f64,
    /// What touches b in place of a itself: a periodic image of it, or ground that moves.
    pub image: Image,
}

/// The image of a body or elastic solid in a periodic domain, or the motion of a wall.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Image {
    /// From the body to its image, m; for the ground without meaning.
    pub offset: Vec3,
    /// Given velocity of the image relative to the body (`L offset` where the velocity gradient L drives the domain), or
    /// that of the wall, m/s.
    pub velocity: Vec3,
}

impl Contact {
    /// A contact with T1 along the world's x axis, or its y axis where the normal is nearly along x.
    pub fn new(a: Option<usize>, b: usize, point: Vec3, normal: Vec3, mu: f64, e: f64) -> Self {
        let tangent = if normal[0].abs() > 0.9 * norm(normal) { Y } else { X };
        Self { a, b, point, normal, tangent, mu, mu_r: 0.0, e, image: Image::default() }
    }

    /// The local frame `[N, T1, T2]`: orthonormal, with T1 × T2 = N.
    pub fn frame(&self) -> [Vec3; 3] {
        let n = normalise(self.normal);
        let t1 = normalise(sub(self.tangent, scale(dot(self.tangent, n), n)));
        [n, t1, cross(n, t1)]
    }

    /// For b and then a, if it is not the ground: the sign with which the contact moves it, its number, and its own point
    /// that touches, which is `offset` away from [`Contact::point`] where an image of it touches.
    pub(crate) fn sides(&self) -> impl Iterator<Item = (f64, usize, Vec3)> {
        let a = self.a.map(|a| (-1.0, a, sub(self.point, self.image.offset)));
        [Some((1.0, self.b, self.point)), a].into_iter().flatten()
    }

    /// Checks every value against a scene of `bodies` bodies; `key` names the contact in messages.
    pub(crate) fn validate(&self, key: &str, bodies: usize) -> Result<(), SceneError> {
        let Self { a, b, point, mu, mu_r, e, image, .. } = *self;
        // A body may touch an image of itself.
        if b >= bodies || a.is_some_and(|a| a >= bodies || (a == b && image.offset == [0.0; 3])) {
            let expected = format!("two different bodies of the {bodies}");
            return Err(SceneError::value(key, expected, format!("a = {a:?}, b = {b}")));
        }
        require(&format!("{key}.point"), point.iter().sum(), true, "finite coordinates")?;
        let image: f64 = image.offset.iter().chain(&image.velocity).sum();
        require(&format!("{key}.image"), image, true, "finite components")?;
        if self.frame().iter().flatten().any(|x| !x.is_finite()) {
            let found = format!("{:?} and {:?}", self.normal, self.tangent);
            let expected = "a normal and a tangent that are not parallel";
            return Err(SceneError::value(format!("{key}.normal"), expected, found));
        }
        require(&format!("{key}.mu"), mu, mu >= 0.0, "a coefficient of at least 0")?;
        require(&format!("{key}.mu_r"), mu_r, mu_r >= 0.0, "a length of at least 0")?;
        require(&format!("{key}.e"), e, (0.0..=1.0).contains(&e), "a coefficient from 0 to 1")
    }
}
