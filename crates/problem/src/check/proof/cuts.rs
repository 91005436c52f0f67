//! What terms that are not linear say together with each other and with x: linear inequalities that hold wherever the terms have values. With them a relaxation sees what bounds of single terms do
//! not, as that `x² − x + 1 > 0`.
//!
//! ```text
//! quadratic terms of a row    g(x) = Σ c_t N_t(x), ±∇²g ⪰ 0:   ±Σ c_t y_t ≥ ±(g(x̄) + ∇g(x̄)ᵀ(x − x̄)),   x̄ where g and the row's own linear part are stationary
//! exp, −log, −√ of a(x)       y ≥ s a(x) − φ*(s),   a affine, φ* the conjugate:   s = 1, and the slopes with which the linear part of a row cancels
//! |a(x)|                      y ≥ ±a(x)
//! a(x) b(x)                   (a − α)(b − β) ≥ 0,   α and β a bound of each:   McCormick's hull; of a square the secant
//! ```
//!
//! Coefficients are rational numbers; only φ* of exp and log is rounded, outwards. Completing squares is exact: with x̄ from a row, the inequality is the row's least value as far as that is quadratic.
//!
//! References: McCormick1976. Cost: an elimination of up to ten variables a row in rational numbers. Fails, that is, says nothing: where a row's Hessian is indefinite, and along several rows together that
//! are not quadratic each by itself.

use std::collections::{BTreeMap, BTreeSet};

use super::exact::{Exact, exact, negative};
use super::relaxation::around;
use crate::field::{Binary, Combination, Expressions, Id, Node, Range, Term, Unary};

/// `Σ c_t t ≥ least`.
pub(super) struct Cut {
    pub(super) terms: BTreeMap<Term, Exact>,
    pub(super) least: Exact,
}

/// Variables of a quadratic form that is not a sum of squares of single ones: its elimination grows.
const COUPLED: usize = 10;

/// `Σ c_j x_j + d`
struct Affine {
    terms: BTreeMap<usize, Exact>,
    constant: Exact,
}

impl Affine {
    fn of(row: &Combination) -> Option<Self> {
        let variable = |(term, c): (&Term, &Exact)| match term {
            Term::Variable(j) => Some((*j, c.clone())),
            Term::Node(_) => None,
        };
        let terms = row.terms.iter().map(variable).collect::<Option<_>>()?;
        Some(Self { terms, constant: row.constant.clone() })
    }

    /// The least and the largest value over a box, where these are finite.
    fn bounds(&self, lower: &[f64], upper: &[f64]) -> [Option<Exact>; 2] {
        let extreme = |largest: bool| {
            let mut sum = self.constant.clone();
            for (j, c) in &self.terms {
                let x = if negative(c) == largest { lower[*j] } else { upper[*j] };
                if !x.is_finite() {
                    return None;
                }
                sum += c * exact(x);
            }
            Some(sum)
        };
        [extreme(false), extreme(true)]
    }
}

/// A function of one number whose graph lies on one side of its tangents.
#[derive(Clone, Copy)]
enum Curve {
    Exp,
    Log,
    Sqrt,
    Abs,
}

/// A term of affine arguments.
enum Shape {
    Product(Id, Id),
    Curve(Curve, Id),
}

impl Shape {
    fn of(field: &Expressions, id: Id) -> Option<Self> {
        let node = |id: &Id| field.graph().node(*id);
        Some(match node(&id) {
            Node::Unary(Unary::Square, a) => Self::Product(*a, *a),
            Node::Binary(Binary::Mul, a, b) => Self::Product(*a, *b),
            Node::Binary(Binary::Pow, a, b) if matches!(node(b), Node::Constant(2.0)) => {
                Self::Product(*a, *a)
            }
            Node::Unary(Unary::Exp, a) => Self::Curve(Curve::Exp, *a),
            Node::Unary(Unary::Log, a) => Self::Curve(Curve::Log, *a),
            Node::Unary(Unary::Sqrt, a) => Self::Curve(Curve::Sqrt, *a),
            Node::Unary(Unary::Abs, a) => Self::Curve(Curve::Abs, *a),
            _ => return None,
        })
    }

    fn arguments(&self) -> [Id; 2] {
        match *self {
            Self::Product(a, b) => [a, b],
            Self::Curve(_, a) => [a, a],
        }
    }
}

/// The cuts of these rows over a box, those of rows first. `None` where the time is over before.
pub(super) fn cuts(
    field: &Expressions,
    rows: &[Combination],
    lower: &[f64],
    upper: &[f64],
) -> Option<Vec<Cut>> {
    let node = |term: &Term| if let Term::Node(id) = term { Some(*id) } else { None };
    let nodes: BTreeSet<Id> =
        rows.iter().flat_map(|row| row.terms.keys().filter_map(node)).collect();
    let shapes: BTreeMap<Id, Shape> =
        nodes.into_iter().filter_map(|id| Some((id, Shape::of(field, id)?))).collect();
    let arguments: BTreeSet<Id> = shapes.values().flat_map(Shape::arguments).collect();
    let arguments: Vec<Id> = arguments.into_iter().collect();
    let apart = field.taken_apart(&arguments)?;
    let affine: BTreeMap<Id, Affine> = arguments
        .into_iter()
        .zip(&apart)
        .filter_map(|(id, row)| Some((id, Affine::of(row)?)))
        .collect();
    let known = |shape: &&Shape| shape.arguments().iter().all(|a| affine.contains_key(a));

    let mut out: Vec<Cut> = vec![];
    let mut slopes: BTreeMap<Id, BTreeSet<Exact>> = BTreeMap::new();
    for row in rows {
        let terms = row.terms.iter().filter_map(|(term, c)| {
            let id = node(term)?;
            Some((id, c, shapes.get(&id).filter(known)?))
        });
        let mut products = vec![];
        for (id, c, shape) in terms {
            match shape {
                Shape::Product(a, b) => products.push((id, c, [&affine[a], &affine[b]])),
                Shape::Curve(_, a) => {
                    let own = affine[a].terms.iter().filter_map(|(j, a)| {
                        let linear = row.terms.get(&Term::Variable(*j))?;
                        Some(-linear / (c * a))
                    });
                    slopes.entry(id).or_default().extend(own);
                }
            }
        }
        out.extend(completed(row, &products));
    }
    for (id, shape) in shapes.iter().filter(|(_, shape)| known(shape)) {
        let y = Term::Node(*id);
        match shape {
            Shape::Product(a, b) => {
                let [a, b] = [(a, &affine[a]), (b, &affine[b])];
                out.extend(hull(y, a.1, b.1, a.0 == b.0, lower, upper));
            }
            Shape::Curve(curve, a) => {
                let own = slopes.get(id).into_iter().flatten().cloned();
                let all: BTreeSet<Exact> = own.chain([Exact::ONE, -Exact::ONE]).collect();
                out.extend(all.iter().filter_map(|s| tangent(y, *curve, &affine[a], s)));
            }
        }
    }
    Some(out)
}

/// The quadratic terms of a row at the place where they and its linear part are stationary, if their Hessian is semidefinite.
fn completed(row: &Combination, products: &[(Id, &Exact, [&Affine; 2])]) -> Option<Cut> {
    let variables: BTreeSet<usize> = products
        .iter()
        .flat_map(|(_, _, ab)| ab.iter().flat_map(|a| a.terms.keys().copied()))
        .collect();
    let place: BTreeMap<usize, usize> =
        variables.iter().enumerate().map(|(at, &j)| (j, at)).collect();
    let n = place.len();
    // g(x) = ½ xᵀ H x + pᵀ x + r
    let mut p = vec![Exact::ZERO; n];
    let mut r = Exact::ZERO;
    let mut entries: BTreeMap<(usize, usize), Exact> = BTreeMap::new();
    for (_, c, [a, b]) in products {
        r += *c * &a.constant * &b.constant;
        for (one, other) in [(a, b), (b, a)] {
            for (j, x) in &one.terms {
                p[place[j]] += *c * x * &other.constant;
                for (k, y) in &other.terms {
                    *entries.entry((place[j], place[k])).or_insert(Exact::ZERO) += *c * x * y;
                }
            }
        }
    }
    let diagonal = entries.iter().all(|((j, k), x)| j == k || x.is_zero());
    if n == 0 || (!diagonal && n > COUPLED) {
        return None;
    }
    let linear = |j: &usize| row.terms.get(&Term::Variable(*j)).cloned().unwrap_or_default();
    let right: Vec<Exact> = variables.iter().map(|j| -(&p[place[j]] + linear(j))).collect();
    let (sign, at) = [Exact::ONE, -Exact::ONE]
        .into_iter()
        .find_map(|sign| Some((sign.clone(), stationary(&entries, &right, &sign)?)))?;
    // ∇g(x̄) = H x̄ + p, and g(x̄) − ∇g(x̄)ᵀ x̄ = r − ½ x̄ᵀ H x̄.
    let mut slope = p;
    let mut square = Exact::ZERO;
    for ((j, k), x) in &entries {
        slope[*j] += x * &at[*k];
        square += x * &at[*j] * &at[*k];
    }
    let mut terms: BTreeMap<Term, Exact> =
        products.iter().map(|(id, c, _)| (Term::Node(*id), &sign * *c)).collect();
    let of_x = variables.iter().zip(&slope).filter(|(_, s)| !s.is_zero());
    terms.extend(of_x.map(|(j, s)| (Term::Variable(*j), -(&sign * s))));
    Some(Cut { terms, least: &sign * (r - square / Exact::from(2)) })
}

/// x with `H x = right`, as far as H is regular, where `sign·H` is positive semidefinite; `None` where it is not.
fn stationary(
    entries: &BTreeMap<(usize, usize), Exact>,
    right: &[Exact],
    sign: &Exact,
) -> Option<Vec<Exact>> {
    let n = right.len();
    let mut rows: Vec<BTreeMap<usize, Exact>> = vec![BTreeMap::new(); n];
    for ((j, k), x) in entries.iter().filter(|(_, x)| !x.is_zero()) {
        rows[*j].insert(*k, sign * x);
    }
    let mut right: Vec<Exact> = right.iter().map(|x| sign * x).collect();
    for k in 0..n {
        let pivot = rows[k].get(&k).cloned().unwrap_or_default();
        let others: Vec<(usize, Exact)> =
            rows[k].range(k + 1..).map(|(j, x)| (*j, x.clone())).collect();
        if negative(&pivot) || (pivot.is_zero() && !others.is_empty()) {
            return None;
        }
        // By symmetry the entries below the pivot are those beside it.
        for (i, x) in &others {
            let factor = x / &pivot;
            for (j, y) in &others {
                let entry = rows[*i].entry(*j).or_insert(Exact::ZERO);
                *entry -= &factor * y;
                if entry.is_zero() {
                    rows[*i].remove(j);
                }
            }
            let less = &factor * &right[k];
            right[*i] -= less;
        }
    }
    let mut x = vec![Exact::ZERO; n];
    for k in (0..n).rev() {
        if let Some(pivot) = rows[k].get(&k) {
            let known = rows[k].range(k + 1..).map(|(j, y)| y * &x[*j]);
            x[k] = known.fold(right[k].clone(), |left, y| left - y) / pivot;
        }
    }
    Some(x)
}

/// What bounds of two factors say of their product y.
fn hull(y: Term, a: &Affine, b: &Affine, square: bool, lower: &[f64], upper: &[f64]) -> Vec<Cut> {
    let (of_a, of_b) = (a.bounds(lower, upper), b.bounds(lower, upper));
    let sides: &[(usize, usize)] =
        if square { &[(0, 1)] } else { &[(0, 0), (1, 1), (0, 1), (1, 0)] };
    let cut = |&(i, k): &(usize, usize)| {
        let (alpha, beta) = (of_a[i].as_ref()?, of_b[k].as_ref()?);
        // (a − α)(b − β) has the sign of both sides.
        let sign = Exact::from(if i == k { 1 } else { -1 });
        // sign (y − β a − α b + α β) ≥ 0
        let mut terms: BTreeMap<Term, Exact> = [(y, sign.clone())].into();
        for (form, factor) in [(a, beta), (b, alpha)] {
            for (j, x) in &form.terms {
                *terms.entry(Term::Variable(*j)).or_insert(Exact::ZERO) -= &sign * factor * x;
            }
        }
        terms.retain(|_, c| !c.is_zero());
        let least = &sign * (beta * &a.constant + alpha * &b.constant - alpha * beta);
        Some(Cut { terms, least })
    };
    sides.iter().filter_map(cut).collect()
}

/// The tangent of slope s to `y = φ(a)`; `None` where there is none.
fn tangent(y: Term, curve: Curve, a: &Affine, s: &Exact) -> Option<Cut> {
    let positive = !negative(s) && !s.is_zero();
    let one = Range::point(1.0);
    // ±(y − s a) ≥ value
    let (sign, value) = match curve {
        // e^a − s a ≥ s (1 − ln s)
        Curve::Exp if positive => (1, around(s).mul(one.add(around(s).ln().neg())).low),
        // s a − ln a ≥ 1 + ln s
        Curve::Log if positive => (-1, one.add(around(s).ln()).low),
        // s a − √a ≥ −1/(4 s)
        Curve::Sqrt if positive => {
            return Some(line(y, -1, a, s, -(Exact::ONE / (Exact::from(4) * s))));
        }
        Curve::Abs if *s == Exact::ONE || *s == -Exact::ONE => (1, 0.0),
        _ => return None,
    };
    value.is_finite().then(|| line(y, sign, a, s, exact(value)))
}

/// `sign (y − s a(x)) ≥ least`
fn line(y: Term, sign: i8, a: &Affine, s: &Exact, least: Exact) -> Cut {
    let sign = Exact::from(sign);
    let mut terms: BTreeMap<Term, Exact> =
        a.terms.iter().map(|(j, x)| (Term::Variable(*j), -(&sign * s * x))).collect();
    terms.insert(y, sign.clone());
    Cut { terms, least: least + &sign * s * &a.constant }
}

#[cfg(test)]
mod tests {
    use super::super::exact::rounded;
    use super::*;

    fn field(rows: &[&str]) -> Expressions {
        let rows: Vec<_> = rows.iter().map(ToString::to_string).collect();
        Expressions::parse(&rows, &[]).unwrap()
    }

    fn apart(field: &Expressions) -> Vec<Combination> {
        let all: Vec<usize> = (0..field.rows().len()).collect();
        field.combinations(&all).unwrap()
    }

    /// The nodes' values at x, by fields with these nodes for rows.
    fn value(f: &Expressions, id: Id, x: &[f64]) -> f64 {
        use crate::field::Field;
        let rows = vec![id; x.len()];
        let g = Expressions::new(f.graph().clone(), rows).unwrap();
        let mut out = vec![0.0; x.len()];
        g.evaluator().value(x, &mut out);
        out[0]
    }

    #[test]
    fn cuts_hold_at_all_points_of_the_box() {
        let cases: &[&[&str]] = &[
            &["x1^2 - 3*x1*x2 + 5*x2^2 - x1 + 2", "x1*x2 - exp(x1 - 2*x2) + 3*x1"],
            &["2*exp(x1) - 5*x1 + log(x2 + 2) - 0.3*x2", "sqrt(x2 + 1.5) - 4*x2 + abs(x1 - x2)"],
            &["(x1 - 1)*(2*x2 + x1) - (x1 + x2 - 3)^2", "-x1^2 - x2^2 + 0.1*x1"],
        ];
        let (lower, upper) = ([-1.0, -0.5], [2.0, 1.5]);
        let mut seen = 0;
        for rows in cases {
            let f = field(rows);
            let cuts = cuts(&f, &apart(&f), &lower, &upper).unwrap();
            assert!(cuts.len() >= 4, "{rows:?}: {}", cuts.len());
            for (i, k) in (0..=20).flat_map(|i| (0..=20).map(move |k| (i, k))) {
                let x = [lower[0] + 0.15 * f64::from(i), lower[1] + 0.1 * f64::from(k)];
                for cut in &cuts {
                    let term = |(t, c): (&Term, &Exact)| {
                        rounded(c)
                            * match t {
                                Term::Variable(j) => x[*j],
                                Term::Node(id) => value(&f, *id, &x),
                            }
                    };
                    let left: f64 = cut.terms.iter().map(term).sum();
                    assert!(left >= rounded(&cut.least) - 1e-12, "{rows:?} at {x:?}");
                    seen += 1;
                }
            }
        }
        assert!(seen > 5000, "{seen}");
    }

    #[test]
    fn squares_are_completed_exactly() {
        // x1² − x1 = (x1 − ½)² − ¼: the linear part cancels.
        let f = field(&["x1^2 - x1 + 1", "x2"]);
        let rows = apart(&f);
        let free = [f64::NEG_INFINITY; 2];
        let cuts = cuts(&f, &rows, &free, &[f64::INFINITY; 2]).unwrap();
        let [cut] = &cuts[..] else { panic!("{}", cuts.len()) };
        assert_eq!(cut.terms[&Term::Variable(0)], -Exact::ONE);
        assert_eq!(rounded(&cut.least), -0.25);
        // An indefinite form says nothing, a negative semidefinite one does.
        assert!(completed_of("x1^2 - 3*x1*x2 + x2^2").is_none());
        assert!(completed_of("2*x1*x2 - x1^2 - x2^2 + x1 - x2").is_some());
    }

    fn completed_of(row: &str) -> Option<Cut> {
        let f = field(&[row, "x2"]);
        let free = [f64::NEG_INFINITY; 2];
        cuts(&f, &apart(&f), &free, &[f64::INFINITY; 2]).unwrap().into_iter().next()
    }
}
