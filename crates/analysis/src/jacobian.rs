//! Whether a Jacobian is one: its entries beside differences of F.

use nonsmooth_linalg::budget;
use nonsmooth_problem::field::{Evaluator, Field};
use serde::Serialize;

/// How the entries of a Jacobian agree with central differences of F at a point.
///
/// `d_ij = (F_i(x + h e_j) − F_i(x − h e_j)) / 2h` with `h = ε^⅓ max(|x_j|, 10⁻³)`, and again with h/2. An entry agrees where
/// `|J_ij − d_ij| ≤ 10⁻⁶ max(|J_ij|, |d_ij|) + 4 |d_ij(h) − d_ij(h/2)| + 16 ε D_i / h`, D_i being the size of the row's terms: nothing is held against it that comes
/// from curvature or rounding. Where F is not defined on one side the difference is that of the other side. Entries outside of the pattern are 0.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct JacobianCheck {
    /// Entries of the pattern that were compared.
    pub compared: usize,
    /// Entries of the pattern where no difference is defined.
    pub undefined: usize,
    /// How many entries do not agree, those outside of the pattern counted in.
    pub wrong: usize,
    /// The one that agrees least, in shares of what it may differ by: the worst of those that do not agree, if there are such.
    pub worst: Option<Entry>,
}

/// An entry with its difference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Entry {
    /// i
    pub row: usize,
    /// j
    pub column: usize,
    /// J_ij; 0 outside of the pattern.
    pub stated: f64,
    /// d_ij
    pub difference: f64,
    /// Whether the pattern has a place for it.
    pub in_pattern: bool,
    /// `|J_ij − d_ij|` over what it may be: above 1 it does not agree.
    pub excess: f64,
}

/// Relative errors that are not held against an entry.
const ALLOWED: f64 = 1e-6;

impl JacobianCheck {
    /// Compares all entries at x. `None` where F or its Jacobian is not defined at x, or the time is over. Cost: four values of F for each group of columns that
    /// share no row, and for each column of a group in which something does not agree.
    pub fn of(field: &dyn Field, x: &[f64]) -> Option<Self> {
        let (n, pattern) = (field.dim(), field.pattern());
        let mut run = field.evaluator();
        let (mut f, mut jacobian) = (vec![0.0; n], vec![0.0; pattern.len()]);
        if !run.jacobian(x, &mut f, &mut jacobian) {
            return None;
        }
        let mut sizes = vec![0.0; n];
        if !run.sizes(x, &mut sizes) {
            sizes.fill(0.0);
        }
        sizes
            .iter_mut()
            .zip(&f)
            .for_each(|(d, f)| *d = if d.is_finite() { d.max(f.abs()) } else { f.abs() });
        let mut out = Self::default();
        let mut places = vec![vec![]; n];
        for i in 0..n {
            pattern.range(i).zip(pattern.row(i)).for_each(|(at, &j)| places[j].push((i, at)));
        }
        let mut probe = Probe { run, f: &f, x, y: x.to_vec(), sides: [vec![0.0; n], vec![0.0; n]] };
        // The place of each row in the columns looked at.
        let mut of_row: Vec<Option<(usize, usize)>> = vec![None; n];
        for group in pattern.groups(n) {
            // Where a difference of all columns at once does not agree, one after the other.
            let mut left = vec![&group[..]];
            while let Some(columns) = left.pop() {
                if budget::over() {
                    return None;
                }
                of_row.fill(None);
                for &j in columns {
                    places[j].iter().for_each(|&(i, at)| of_row[i] = Some((j, at)));
                }
                let mut found = Self::default();
                match probe.differences(columns) {
                    None => found.undefined = of_row.iter().flatten().count(),
                    Some(differences) => {
                        for (i, place) in of_row.iter().enumerate() {
                            let (j, stated) =
                                place.map_or((columns[0], 0.0), |(j, at)| (j, jacobian[at]));
                            let d = differences.at(i, probe.step(j));
                            if place.is_some() || d.0 != 0.0 {
                                found.look(i, j, stated, place.is_some(), d, sizes[i]);
                            }
                        }
                    }
                }
                if columns.len() > 1 && (found.wrong > 0 || found.undefined > 0) {
                    left.extend(columns.chunks(1));
                } else {
                    out.add(found);
                }
            }
        }
        Some(out)
    }

    fn add(&mut self, other: Self) {
        self.compared += other.compared;
        self.undefined += other.undefined;
        self.wrong += other.wrong;
        let excess = |check: &Self| check.worst.map_or(-1.0, |worst| worst.excess);
        if excess(&other) > excess(self) {
            self.worst = other.worst;
        }
    }

    /// Whether all entries agree.
    pub fn agrees(&self) -> bool {
        self.wrong == 0
    }

    /// Counts an entry beside a difference.
    fn look(
        &mut self,
        row: usize,
        column: usize,
        stated: f64,
        in_pattern: bool,
        (d, curved, h): (f64, f64, f64),
        size: f64,
    ) {
        let may =
            ALLOWED * stated.abs().max(d.abs()) + 4.0 * curved + 16.0 * f64::EPSILON * size / h;
        let error = (stated - d).abs();
        let excess = if error == 0.0 { 0.0 } else { error / may };
        let excess = if excess.is_nan() { f64::INFINITY } else { excess };
        self.compared += usize::from(in_pattern);
        self.wrong += usize::from(excess > 1.0);
        if self.worst.is_none_or(|worst| excess > worst.excess) {
            self.worst = Some(Entry { row, column, stated, difference: d, in_pattern, excess });
        }
    }
}

/// Values of F about a point.
struct Probe<'a> {
    run: Box<dyn Evaluator>,
    f: &'a [f64],
    x: &'a [f64],
    y: Vec<f64>,
    sides: [Vec<f64>; 2],
}

/// Differences of all rows along a group of columns, with steps and with half of them.
struct Differences {
    changes: [Vec<f64>; 2],
    /// How many steps lie between the two points of each.
    spans: [f64; 2],
}

impl Differences {
    /// Of row i along a column with step h: the difference, its uncertainty by curvature, and h.
    fn at(&self, i: usize, h: f64) -> (f64, f64, f64) {
        let [whole, half] = [0, 1].map(|k| self.changes[k][i] / (self.spans[k] * h));
        (half, (whole - half).abs(), h)
    }
}

impl Probe<'_> {
    /// `ε^⅓ max(|x_j|, 10⁻³)` as a power of two, so that `x_j ± h` is nearly exact.
    fn step(&self, j: usize) -> f64 {
        (f64::EPSILON.cbrt() * self.x[j].abs().max(1e-3)).log2().round().exp2()
    }

    /// Along columns that no row shares. `None` where F is defined on neither side.
    fn differences(&mut self, group: &[usize]) -> Option<Differences> {
        let (whole, first) = self.difference(group, 1.0)?;
        let (half, second) = self.difference(group, 0.5)?;
        Some(Differences { changes: [whole, half], spans: [first, 0.5 * second] })
    }

    /// The change of F between points so many steps to both sides, or to one, and the number of sides.
    fn difference(&mut self, group: &[usize], steps: f64) -> Option<(Vec<f64>, f64)> {
        let defined = [steps, -steps].map(|steps| {
            for &j in group {
                self.y[j] = self.x[j] + steps * self.step(j);
            }
            let side = &mut self.sides[usize::from(steps < 0.0)];
            self.run.value(&self.y, side)
        });
        group.iter().for_each(|&j| self.y[j] = self.x[j]);
        let [up, down] = &self.sides;
        let between = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
        match defined {
            [true, true] => Some((between(up, down), 2.0)),
            [true, false] => Some((between(up, self.f), 1.0)),
            [false, true] => Some((between(self.f, down), 1.0)),
            [false, false] => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_problem::field::{Expressions, Pattern};

    fn expressions(texts: &[&str]) -> Expressions {
        let texts: Vec<_> = texts.iter().map(ToString::to_string).collect();
        Expressions::parse(&texts, &[]).unwrap()
    }

    #[test]
    fn exact_jacobians_agree_on_every_scale_and_at_rims() {
        let f =
            expressions(&["exp(x1*x2) - x3^3 + 1e6*x1", "sqrt(x2) + log(x1)", "1e-9*sin(x3)/x1"]);
        for x in [[1.0, 2.0, 3.0], [0.5, 1e-3, 1e4], [1e3, 1e-3, -1e-6]] {
            let check = JacobianCheck::of(&f, &x).unwrap();
            assert!(check.agrees(), "{x:?} {check:?}");
            assert_eq!((check.compared, check.undefined), (7, 0));
        }
        // The root is defined on one side of 0 only, with an infinite slope there.
        assert!(JacobianCheck::of(&f, &[1.0, 0.0, 1.0]).is_none());
        let rim = expressions(&["x1^1.5"]);
        assert!(JacobianCheck::of(&rim, &[0.0]).unwrap().agrees());
    }

    /// A field with one entry of its Jacobian off, or its pattern without a place.
    #[derive(Debug)]
    struct Wrong {
        of: Expressions,
        pattern: Pattern,
        off: usize,
        by: f64,
    }

    impl Field for Wrong {
        fn dim(&self) -> usize {
            self.of.dim()
        }
        fn pattern(&self) -> &Pattern {
            &self.pattern
        }
        fn source(&self) -> String {
            "by hand".into()
        }
        fn evaluator(&self) -> Box<dyn Evaluator> {
            struct Run(Box<dyn Evaluator>, Vec<(usize, usize)>, Vec<(usize, usize)>, usize, f64);
            impl Evaluator for Run {
                fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
                    self.0.value(x, f)
                }
                fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool {
                    let mut all = vec![0.0; self.1.len()];
                    let defined = self.0.jacobian(x, f, &mut all);
                    for (out, place) in jacobian.iter_mut().zip(&self.2) {
                        *out = all[self.1.iter().position(|p| p == place).unwrap()];
                    }
                    jacobian[self.3] *= self.4;
                    defined
                }
            }
            let places = |pattern: &Pattern| pattern.places().collect();
            let (whole, own) = (places(self.of.pattern()), places(&self.pattern));
            Box::new(Run(self.of.evaluator(), whole, own, self.off, self.by))
        }
    }

    #[test]
    fn a_wrong_entry_is_named() {
        let of = || expressions(&["x1^2 + x2", "x2^3 - x1*x3", "exp(x3)"]);
        let pattern = of().pattern().clone();
        let x = [1.0, 2.0, 0.5];
        let wrong = Wrong { of: of(), pattern, off: 3, by: 1.0 + 1e-4 };
        let check = JacobianCheck::of(&wrong, &x).unwrap();
        let worst = check.worst.unwrap();
        assert_eq!((check.wrong, worst.row, worst.column, worst.in_pattern), (1, 1, 1, true));
        assert!((worst.difference - 12.0).abs() < 1e-6 && worst.stated > 12.001);
        // Without a place for −x1 x3 along x3.
        let pattern =
            Pattern::new([vec![0, 1], vec![0, 1], vec![2]].into_iter().map(Vec::into_iter));
        let wrong = Wrong { of: of(), pattern, off: 0, by: 1.0 };
        let check = JacobianCheck::of(&wrong, &x).unwrap();
        let worst = check.worst.unwrap();
        assert_eq!((check.wrong, worst.row, worst.column, worst.in_pattern), (1, 1, 2, false));
        assert_eq!(worst.difference, -1.0);
    }
}
