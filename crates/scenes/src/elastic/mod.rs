//! Elastic solids: boxes of trilinear hexahedra (H8), small displacements, linear isotropic elasticity.

mod element;

use nonsmooth_linalg::Csc;

use crate::SceneError;
use crate::error::{positive, require};
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, add, cross, norm, sub};

/// A linear isotropic elastic material with Rayleigh damping `C = α M + β K`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Young's modulus E, Pa.
    pub young: f64,
    /// Poisson's ratio ν, between −1 and 1/2.
    pub poisson: f64,
    /// Damping in proportion to the mass, 1/s.
    pub alpha: f64,
    /// Damping in proportion to the stiffness, s.
    pub beta: f64,
}

impl Material {
    /// Lamé's `λ = E ν / ((1 + ν)(1 − 2ν))` and `G = E / (2 (1 + ν))`, Pa.
    pub fn lame(&self) -> (f64, f64) {
        let Self { young, poisson, .. } = *self;
        let shear = young / (2.0 * (1.0 + poisson));
        (2.0 * shear * poisson / (1.0 - 2.0 * poisson), shear)
    }

    fn validate(&self, key: &str) -> Result<(), SceneError> {
        let Self { density, young, poisson, alpha, beta } = *self;
        positive(&format!("{key}density"), density)?;
        positive(&format!("{key}young"), young)?;
        let possible = -1.0 < poisson && poisson < 0.5;
        require(&format!("{key}poisson"), poisson, possible, "a number between -1 and 0.5")?;
        require(&format!("{key}alpha"), alpha, alpha >= 0.0, "a number of at least 0")?;
        require(&format!("{key}beta"), beta, beta >= 0.0, "a number of at least 0")
    }
}

/// A box along the axes of the world, meshed by equal trilinear hexahedra: 3 degrees of freedom a node.
///
/// Node (i, j, k) has the number `i + (n_x + 1)(j + (n_y + 1) k)` and the place that it has in the box without
/// strain; displacements are small, so that neither the mesh nor contacts move with them. Full integration
/// makes thin elements too stiff in bending, as is known of H8, and near ν = 1/2.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticBox {
    /// Sides, m.
    pub sides: Vec3,
    /// The centre, m.
    pub position: Vec3,
    /// Elements along each axis.
    pub elements: [usize; 3],
    /// What it is made of.
    pub material: Material,
    /// Weight of the end of the time step in the elastic and damping forces, from 1/2 (which keeps the energy) to 1.
    pub theta: f64,
    /// Masses at the nodes in place of the consistent mass matrix.
    pub lumped: bool,
    /// Displacement of each node at the beginning of the step, m.
    pub displacement: Vec<Vec3>,
    /// Velocity of each node at the beginning of the step, m/s.
    pub velocity: Vec<Vec3>,
    /// Whether each node is held, by a support: its velocity is zero.
    pub held: Vec<bool>,
}

/// Nodes closer to a point than this part of an element are the point.
const AT_NODE: f64 = 1e-9;
/// Keeps a slip of the keyboard from filling the memory.
const MOST_NODES: usize = 10_000_000;

impl ElasticBox {
    /// A box at rest without strain, centred at the origin; θ = 1/2, consistent mass, no node held.
    ///
    /// Errors: a side that is not positive, no elements along an axis or too many, an impossible material.
    pub fn new(sides: Vec3, elements: [usize; 3], material: Material) -> Result<Self, SceneError> {
        check_elements("elements", elements)?;
        let nodes = elements.iter().map(|n| n + 1).product();
        let solid = Self {
            sides,
            position: [0.0; 3],
            elements,
            material,
            theta: 0.5,
            lumped: false,
            displacement: vec![[0.0; 3]; nodes],
            velocity: vec![[0.0; 3]; nodes],
            held: vec![false; nodes],
        };
        solid.validate("")?;
        Ok(solid)
    }

    /// The same box with its centre at `position`.
    pub fn at(self, position: Vec3) -> Self {
        Self { position, ..self }
    }

    /// The number of nodes.
    pub fn nodes(&self) -> usize {
        self.elements.iter().map(|n| n + 1).product()
    }

    /// The number of degrees of freedom, those of held nodes included.
    pub fn dofs(&self) -> usize {
        3 * self.nodes()
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        self.material.density * self.sides.iter().product::<f64>()
    }

    /// Half the diagonal, m.
    pub fn radius(&self) -> f64 {
        0.5 * norm(self.sides)
    }

    /// The places of the nodes in the box without strain, by number, m.
    pub fn places(&self) -> impl Iterator<Item = Vec3> + '_ {
        (0..self.nodes()).map(|node| self.place(self.grid(node)))
    }

    /// The places of the nodes of the bottom, which come first, m.
    pub fn bottom(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.places().take(self.nodes() / (self.elements[2] + 1))
    }

    /// Holds every node of the bottom.
    pub fn hold_bottom(&mut self) {
        let layer = self.bottom().count();
        self.held[..layer].fill(true);
        self.velocity[..layer].fill([0.0; 3]);
    }

    /// Whether any node is held.
    pub fn is_held(&self) -> bool {
        self.held.contains(&true)
    }

    /// Adds the velocity of a rigid motion about the centre to every node that is not held.
    pub fn add_velocity(&mut self, linear: Vec3, angular: Vec3) {
        for node in (0..self.nodes()).filter(|&k| !self.held[k]).collect::<Vec<_>>() {
            let arm = sub(self.place(self.grid(node)), self.position);
            self.velocity[node] = add(self.velocity[node], add(linear, cross(angular, arm)));
        }
    }

    /// The velocity of the nodes on average, m/s.
    pub fn mean_velocity(&self) -> Vec3 {
        crate::vec3::mean(&self.velocity)
    }

    /// The mass matrix of all nodes, kg.
    ///
    /// Errors: those of assembly, never of a validated box.
    pub fn mass_matrix(&self) -> Result<Csc, SceneError> {
        self.assembled(self.entries(&self.element_matrices().0))
    }

    /// The stiffness matrix of all nodes, N/m.
    ///
    /// Errors: those of assembly, never of a validated box.
    pub fn stiffness_matrix(&self) -> Result<Csc, SceneError> {
        self.assembled(self.entries(&self.element_matrices().1))
    }

    /// `M̂ = M + h θ C + h² θ² K` for the time step `h`, a held node's rows and columns left out but for the diagonal.
    ///
    /// Errors: those of assembly, never of a validated box.
    pub fn iteration_matrix(&self, h: f64) -> Result<Csc, SceneError> {
        let (mass, stiffness) = self.element_matrices();
        let Material { alpha, beta, .. } = self.material;
        let (m, k) = (1.0 + h * self.theta * alpha, h * self.theta * (beta + h * self.theta));
        let element: element::Matrix = std::array::from_fn(|row| {
            std::array::from_fn(|column| m * mass[row][column] + k * stiffness[row][column])
        });
        let free = |&(i, j, _): &_| i == j || !(self.held[i / 3] || self.held[j / 3]);
        self.assembled(self.entries(&element).filter(free))
    }

    /// `h (F − C v − K x − h θ K v)` with the weight F under `gravity` and the displacement x; zero at held nodes.
    pub(crate) fn drive(&self, h: f64, gravity: Vec3) -> Vec<f64> {
        let (mass, stiffness) = self.element_matrices();
        let Material { alpha, beta, .. } = self.material;
        let slowness = beta + h * self.theta;
        let mut out = vec![0.0; self.dofs()];
        for nodes in self.cells() {
            let dof = |row: usize| 3 * nodes[row / 3] + row % 3;
            // M applied to g − α v is the weight and the damping by mass.
            let inertial: [f64; 24] = std::array::from_fn(|k| {
                gravity[k % 3] - alpha * self.velocity[nodes[k / 3]][k % 3]
            });
            let elastic: [f64; 24] = std::array::from_fn(|k| {
                let node = nodes[k / 3];
                -self.displacement[node][k % 3] - slowness * self.velocity[node][k % 3]
            });
            for row in (0..24).filter(|row| !self.held[nodes[row / 3]]) {
                let sum: f64 = (0..24)
                    .map(|k| mass[row][k] * inertial[k] + stiffness[row][k] * elastic[k])
                    .sum();
                out[dof(row)] += h * sum;
            }
        }
        out
    }

    /// The nodes that move the material point at `point` and their weights: the shape functions that do not
    /// vanish there; nothing outside the box.
    pub(crate) fn weights(&self, point: Vec3) -> Option<Vec<(usize, f64)>> {
        let cell = self.cell();
        let (mut first, mut xi) = ([0; 3], [0.0; 3]);
        for k in 0..3 {
            let n = self.elements[k] as f64;
            let x = (point[k] - self.position[k]) / cell[k] + 0.5 * n;
            let x = if (x - x.round()).abs() < AT_NODE { x.round() } else { x };
            if !(0.0..=n).contains(&x) {
                return None;
            }
            let element = x.floor().min(n - 1.0);
            (first[k], xi[k]) = (element as usize, x - element);
        }
        let corners = self.corners(first);
        let weights = corners.into_iter().zip(element::shapes(xi));
        Some(weights.filter(|&(_, weight)| weight != 0.0).collect())
    }

    /// The nodes on its surface, and the faces of elements there as places among them, counterclockwise from outside.
    pub fn skin(&self) -> (Vec<usize>, Vec<[usize; 4]>) {
        let outside = |&node: &usize| {
            let at = self.grid(node);
            (0..3).any(|k| at[k] == 0 || at[k] == self.elements[k])
        };
        let nodes: Vec<usize> = (0..self.nodes()).filter(outside).collect();
        let mut places = vec![usize::MAX; self.nodes()];
        nodes.iter().enumerate().for_each(|(place, &node)| places[node] = place);
        let [x, y, _] = self.elements.map(|n| n + 1);
        let mut faces = vec![];
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for end in [0, self.elements[axis]] {
                for (j, i) in grid([self.elements[v], self.elements[u]]) {
                    let corner = |(p, q): (usize, usize)| {
                        let mut at = [end; 3];
                        (at[u], at[v]) = (i + p, j + q);
                        places[at[0] + x * (at[1] + y * at[2])]
                    };
                    let face = [(0, 0), (1, 0), (1, 1), (0, 1)].map(corner);
                    faces.push(if end == 0 { [face[3], face[2], face[1], face[0]] } else { face });
                }
            }
        }
        (nodes, faces)
    }

    /// The surface, one face for each face of an element on it, without strain.
    pub(crate) fn surface(&self) -> Result<Polyhedron, SceneError> {
        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for end in [0, self.elements[axis]] {
                let first = vertices.len();
                for (j, i) in grid([self.elements[v] + 1, self.elements[u] + 1]) {
                    let mut at = [end; 3];
                    (at[u], at[v]) = (i, j);
                    vertices.push(self.place(at));
                }
                let row = self.elements[u] + 1;
                for (j, i) in grid([self.elements[v], self.elements[u]]) {
                    let a = first + row * j + i;
                    let face = vec![a, a + 1, a + 1 + row, a + row];
                    faces.push(if end == 0 { face.into_iter().rev().collect() } else { face });
                }
            }
        }
        Polyhedron::new(vertices, faces)
    }

    /// Checks every value; `key` names the solid in messages.
    ///
    /// Errors: the first value that is not possible, by its place.
    pub fn validate(&self, key: &str) -> Result<(), SceneError> {
        let place = |name: &str| {
            if key.is_empty() { name.to_string() } else { format!("{key}.{name}") }
        };
        for side in self.sides {
            positive(&place("sides"), side)?;
        }
        check_elements(&place("elements"), self.elements)?;
        self.material.validate(&place(""))?;
        positive(&place("mass"), self.mass())?;
        let theta = self.theta;
        require(&place("theta"), theta, (0.5..=1.0).contains(&theta), "a number from 0.5 to 1")?;
        require(&place("position"), self.position.iter().sum(), true, "finite components")?;
        let nodes = self.nodes();
        for (name, len) in [
            ("displacement", self.displacement.len()),
            ("velocity", self.velocity.len()),
            ("held", self.held.len()),
        ] {
            if len != nodes {
                let expected = format!("{nodes} entries, one for each node");
                return Err(SceneError::value(place(name), expected, len));
            }
        }
        for (name, field) in [("displacement", &self.displacement), ("velocity", &self.velocity)] {
            for (k, x) in field.iter().enumerate() {
                let key = || place(&format!("{name}[{k}]"));
                if x.iter().any(|x| !x.is_finite()) {
                    return Err(SceneError::value(key(), "finite components", format!("{x:?}")));
                }
                if self.held[k] && name == "velocity" && *x != [0.0; 3] {
                    return Err(SceneError::value(key(), "zero, for it is held", format!("{x:?}")));
                }
            }
        }
        Ok(())
    }

    /// The sides of an element, m.
    pub fn cell(&self) -> Vec3 {
        std::array::from_fn(|k| self.sides[k] / self.elements[k] as f64)
    }

    /// M and K of an element.
    fn element_matrices(&self) -> (element::Matrix, element::Matrix) {
        let (lambda, shear) = self.material.lame();
        let mass = element::mass(self.cell(), self.material.density, self.lumped);
        (mass, element::stiffness(self.cell(), lambda, shear))
    }

    /// The place of node `at` of the grid, m.
    fn place(&self, at: [usize; 3]) -> Vec3 {
        let part: Vec3 = std::array::from_fn(|k| at[k] as f64 / self.elements[k] as f64 - 0.5);
        add(self.position, std::array::from_fn(|k| part[k] * self.sides[k]))
    }

    /// The place in the grid of a node.
    fn grid(&self, node: usize) -> [usize; 3] {
        let [x, y, _] = self.elements.map(|n| n + 1);
        [node % x, node / x % y, node / (x * y)]
    }

    /// The nodes of the element whose first corner is `first` in the grid, in the order of its corners.
    fn corners(&self, first: [usize; 3]) -> [usize; 8] {
        let [x, y, _] = self.elements.map(|n| n + 1);
        std::array::from_fn(|a| {
            let [i, j, k] = std::array::from_fn(|axis| first[axis] + (a >> axis & 1));
            i + x * (j + y * k)
        })
    }

    /// The nodes of each element.
    fn cells(&self) -> impl Iterator<Item = [usize; 8]> + Clone + '_ {
        let [x, y, z] = self.elements;
        (0..x * y * z).map(move |e| self.corners([e % x, e / x % y, e / (x * y)]))
    }

    fn assembled(
        &self,
        entries: impl Iterator<Item = (usize, usize, f64)> + Clone,
    ) -> Result<Csc, SceneError> {
        Ok(Csc::from_triplets(self.dofs(), self.dofs(), entries)?)
    }

    /// The entries of the matrix that has `element` for each element.
    fn entries<'a>(
        &'a self,
        element: &'a element::Matrix,
    ) -> impl Iterator<Item = (usize, usize, f64)> + Clone + 'a {
        self.cells().flat_map(move |nodes| {
            let dof = move |row: usize| 3 * nodes[row / 3] + row % 3;
            (0..24 * 24).map(|k| (k / 24, k % 24)).filter_map(move |(row, column)| {
                let x = element[row][column];
                (x != 0.0).then(|| (dof(row), dof(column), x))
            })
        })
    }
}

/// At least one element along each axis, and a number of nodes that memory can hold.
fn check_elements(key: &str, elements: [usize; 3]) -> Result<(), SceneError> {
    let times = |product: usize, n: &usize| product.checked_mul(n.checked_add(1)?);
    let nodes = elements.iter().try_fold(1, times);
    if nodes.is_some_and(|n| n <= MOST_NODES) && !elements.contains(&0) {
        return Ok(());
    }
    let expected = format!("at least 1 along each axis and at most {MOST_NODES} nodes");
    Err(SceneError::value(key, expected, format!("{elements:?}")))
}

/// The places of a grid, the last index fastest.
fn grid(n: [usize; 2]) -> impl Iterator<Item = (usize, usize)> {
    (0..n[0]).flat_map(move |j| (0..n[1]).map(move |i| (j, i)))
}
