//! Elastic solids of a world.

use nonsmooth_scenes::ElasticBox;
use nonsmooth_scenes::vec3::{Vec3, add, norm};

use crate::state::ElasticState;
use crate::{SimulateError, World};

/// An elastic box in a world: linear elasticity of small strains and small turns, about the axes of the world. The nodes of its surface that are not held touch the shapes of
/// bodies, and the faces of other elastic boxes of coarser mesh, which of equal ones is the earlier; what is smaller than an element passes between them. The scheme's θ is that of the world, whatever the box says.
#[derive(Debug, Clone, PartialEq)]
pub struct Elastic {
    /// What messages and files call it; may be empty.
    pub name: String,
    /// Mesh, material, and displacements and velocities at the start.
    pub solid: ElasticBox,
    /// The material of its surface, by number.
    pub material: usize,
}

impl Elastic {
    /// A box of the first material.
    pub fn new(solid: ElasticBox) -> Self {
        Self { name: String::new(), solid, material: 0 }
    }

    /// With a name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// With this material.
    #[must_use]
    pub fn of(self, material: usize) -> Self {
        Self { material, ..self }
    }

    /// The nodes that may touch bodies.
    pub fn touching(&self) -> impl Iterator<Item = usize> + '_ {
        self.solid.skin().0.into_iter().filter(|&node| !self.solid.held[node])
    }

    /// Whether its nodes touch the faces of the other, and not the other way round, were it the earlier of the two.
    pub(crate) fn is_finer_than(&self, other: &Self) -> bool {
        let [own, other] = [self, other].map(|e| norm(e.solid.cell()));
        own < other * (1.0 - 1e-9)
    }

    /// Where its nodes are, m.
    pub fn positions<'a>(&'a self, state: &'a ElasticState) -> impl Iterator<Item = Vec3> + 'a {
        self.solid.places().zip(&state.displacement).map(|(x, &q)| add(x, q))
    }

    pub(crate) fn start(&self) -> ElasticState {
        let ElasticBox { displacement, velocity, .. } = &self.solid;
        ElasticState { displacement: displacement.clone(), velocity: velocity.clone() }
    }

    pub(crate) fn validate(&self, key: &str, world: &World) -> Result<(), SimulateError> {
        self.solid.validate(key)?;
        if self.name.contains('/') || self.name == "." {
            let expected = "a name without `/`, other than `.`, which files cannot hold";
            return Err(SimulateError::value(format!("{key}.name"), expected, &self.name));
        }
        let count = world.materials().len();
        if self.material >= count {
            let expected = format!("one of the {count} materials");
            return Err(SimulateError::value(format!("{key}.material"), expected, self.material));
        }
        let rolls = |&m: &usize| world.law_between(self.material, m).mu_r != 0.0;
        if let Some(other) = (0..count).find(rolls) {
            return Err(SimulateError::value(
                format!("{}.mu_r", world.law_place(self.material, other)),
                format!("0, for {key} is elastic: its nodes do not roll"),
                world.law_between(self.material, other).mu_r,
            ));
        }
        Ok(())
    }
}

/// The nodes that may touch bodies, of all elastic solids of a world: they count on where the bodies end.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nodes {
    pub list: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub solid: u32,
    pub node: u32,
    /// Without strain, m.
    pub place: Vec3,
    /// Half the least side of an element, m.
    pub size: f64,
    pub material: usize,
}

impl Nodes {
    pub fn of(world: &World) -> Self {
        let mut list = vec![];
        for (k, elastic) in world.elastic.iter().enumerate() {
            let places: Vec<Vec3> = elastic.solid.places().collect();
            let size = 0.5 * elastic.solid.cell().into_iter().fold(f64::INFINITY, f64::min);
            list.extend(elastic.touching().map(|node| Node {
                solid: k as u32,
                node: node as u32,
                place: places[node],
                size,
                material: elastic.material,
            }));
        }
        Self { list }
    }
}

/// A point of a face of an elastic solid, which a node of another one is over.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    pub solid: u32,
    /// Where it is, m.
    pub place: Vec3,
    /// The nodes of the face by their places among all that may touch, `u32::MAX` for one that is held, and their shares in the point.
    pub parts: [(u32, f64); 4],
}

impl Foot {
    /// The nodes that are not held, with their shares.
    pub fn parts(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let free = self.parts.iter().filter(|p| p.0 != u32::MAX);
        free.map(|&(place, share)| (place as usize, share))
    }
}

impl Node {
    /// Where it is.
    pub fn position(&self, solids: &[ElasticState]) -> Vec3 {
        add(self.place, solids[self.solid as usize].displacement[self.node as usize])
    }
}
