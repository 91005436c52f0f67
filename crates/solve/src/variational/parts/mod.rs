//! What methods for variational inequalities share: projections on the sets.

mod polyhedron;

use nonsmooth_problem::Set;
use polyhedron::Polyhedron;

/// `P_X`, prepared for a set. Cost: n operations, of polyhedra those of the dual method (see the file).
#[derive(Debug, Clone)]
pub struct Projector(Vec<(usize, Part)>);

/// A set that is no product.
#[derive(Debug, Clone)]
enum Part {
    Box(Vec<(f64, f64)>),
    Polyhedron(Polyhedron),
    Ball(Vec<f64>, f64),
    Cone(usize),
}

impl Projector {
    /// For a valid set.
    pub fn new(set: &Set) -> Self {
        let part = |set: &Set| match set {
            Set::Box { lower, upper } => {
                Part::Box(lower.iter().copied().zip(upper.iter().copied()).collect())
            }
            Set::Polyhedron { A, b, C, d } => Part::Polyhedron(Polyhedron::new(A, b, C, d)),
            Set::Ball { centre, radius } => Part::Ball(centre.clone(), *radius),
            Set::SecondOrderCone { dimension } => Part::Cone(*dimension),
            Set::Product(_) => unreachable!("parts are no products"),
        };
        Self(set.parts().into_iter().map(|(first, set)| (first, part(set))).collect())
    }

    /// `y = P_X(p)`. False where X is empty, or the time is over; then y is of no use.
    pub fn onto(&mut self, p: &[f64], y: &mut [f64]) -> bool {
        self.0.iter_mut().all(|(first, part)| {
            let range = *first..*first + part.dim();
            part.onto(&p[range.clone()], &mut y[range])
        })
    }
}

impl Part {
    fn dim(&self) -> usize {
        match self {
            Self::Box(bounds) => bounds.len(),
            Self::Polyhedron(polyhedron) => polyhedron.dim(),
            Self::Ball(centre, _) => centre.len(),
            Self::Cone(n) => *n,
        }
    }

    fn onto(&mut self, p: &[f64], y: &mut [f64]) -> bool {
        match self {
            Self::Box(bounds) => {
                for ((y, p), (l, u)) in y.iter_mut().zip(p).zip(bounds) {
                    *y = if p < l { *l } else { p.min(*u) };
                }
            }
            Self::Polyhedron(polyhedron) => return polyhedron.onto(p, y),
            Self::Ball(centre, radius) => {
                let squares = p.iter().zip(&*centre).map(|(p, c)| (p - c) * (p - c)).sum::<f64>();
                let outside = squares > *radius * *radius;
                for ((y, p), c) in y.iter_mut().zip(p).zip(centre) {
                    *y = if outside { *c + (p - *c) * (*radius / squares.sqrt()) } else { *p };
                }
            }
            // Spectral: λ = x_1 ± ‖x̄‖, with the vectors ½ (1, ± x̄/‖x̄‖).
            Self::Cone(_) => {
                let far = p[1..].iter().map(|x| x * x).sum::<f64>().sqrt();
                let plus = [p[0] + far, p[0] - far].map(|eigenvalue| eigenvalue.max(0.0));
                y[0] = 0.5 * (plus[0] + plus[1]);
                let share = if far > 0.0 { 0.5 * (plus[0] - plus[1]) / far } else { 0.0 };
                y[1..].iter_mut().zip(&p[1..]).for_each(|(y, p)| *y = share * p);
            }
        }
        true
    }
}
