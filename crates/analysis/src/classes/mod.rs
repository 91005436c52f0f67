//! What can be said of the matrix of a complementarity problem: in which classes it is, and what that guarantees.
//!
//! Every statement is a proof, a refutation with a witness that can be verified from M alone, or *unknown* with the reason. Small matrices are decided exactly, by
//! tests of exponential cost with bounds on all rounding errors; for large ones there are tests that suffice for one or the other. What follows from other
//! statements is filled in, so that answers never contradict each other.

mod class;
mod comparison;
mod copositive;
mod definite;
mod finding;
mod graph;
mod interval;
mod minors;
mod sufficient;
mod tableau;

use std::cmp::Ordering;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

pub use class::Class;
pub use finding::{Finding, How, Why, Witness};

use self::class::IMPLICATIONS;
use self::copositive::Submatrices;
use self::definite::Definite;
use self::finding::{doubled, entry, slacks};
use self::graph::{Cutter, components, strong_components};
use self::interval::Interval;
use self::minors::Minors;
use self::sufficient::Transforms;
use nonsmooth_linalg::Matrix;

/// How much the tests may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// The most operations of each test of exponential cost: principal minors of n rows take `6·2ⁿ`, sufficiency and copositivity `n²·2ⁿ`.
    pub operations: u64,
    /// Tests at the cost of more than two factorisations may run at all.
    pub thorough: bool,
}

impl Default for Effort {
    /// Exact up to n = 19 for P, to n = 14 for the others; a second or two at most.
    fn default() -> Self {
        Self { operations: 4_000_000, thorough: true }
    }
}

/// In which classes a matrix is.
///
/// ```
/// use nonsmooth_linalg::{Dense, Matrix};
/// use nonsmooth_analysis::{Class, Classes};
///
/// let m = Matrix::from(Dense::from_rows(&[[1.0, 2.0], [0.0, 1.0]]).unwrap());
/// let classes = Classes::of(&m, Default::default());
/// assert!(classes.is(Class::P) && classes.is_not(Class::PositiveDefinite));
/// assert_eq!(classes.get(Class::Z).to_string(), "refuted by M[0, 1]");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Classes {
    order: usize,
    findings: Vec<Finding>,
}

impl Classes {
    /// All that the effort allows. Cost: a few factorisations, and the operations allowed for each exact test.
    ///
    /// Of an operator, and of a matrix that is not square or has entries that are not finite, nothing is known.
    pub fn of(m: &Matrix, effort: Effort) -> Self {
        let unknown = Finding::Unknown { why: Why::Undecided };
        let mut out = Self { order: m.nrows(), findings: vec![unknown; Class::ALL.len()] };
        let mut finite = true;
        let known = m.for_each(|_, _, x| finite &= x.is_finite());
        if !known {
            out.findings.fill(Finding::Unknown { why: Why::Operator });
        }
        if known && finite && m.nrows() == m.ncols() && m.nrows() > 0 {
            out.dominance(m);
            out.entries(m);
            out.definite(m);
            if effort.thorough {
                out.thorough(m, effort.operations);
            }
        }
        out
    }

    /// What O(nnz) operations and at most two Cholesky factorisations show.
    pub fn quick(m: &Matrix) -> Self {
        Self::of(m, Effort { operations: 0, thorough: false })
    }

    /// The number of rows of the matrix.
    pub fn order(&self) -> usize {
        self.order
    }

    /// What is known of a class.
    pub fn get(&self, class: Class) -> &Finding {
        &self.findings[class as usize]
    }

    /// Surely in the class.
    pub fn is(&self, class: Class) -> bool {
        self.get(class).is_proven()
    }

    /// Surely not in the class.
    pub fn is_not(&self, class: Class) -> bool {
        self.get(class).is_refuted()
    }

    /// In the class, or so near that rounding makes the difference.
    pub fn is_likely(&self, class: Class) -> bool {
        self.get(class).is_likely()
    }

    /// All classes with what is known of them.
    pub fn iter(&self) -> impl Iterator<Item = (Class, &Finding)> {
        Class::ALL.into_iter().zip(&self.findings)
    }

    /// One line for each class: "P: proven (principal minors)".
    pub fn lines(&self) -> Vec<String> {
        self.iter().map(|(class, finding)| format!("{class}: {finding}")).collect()
    }

    /// Whether every witness shows what it is said to show.
    pub fn verify(&self, m: &Matrix) -> bool {
        self.findings.iter().all(|finding| match finding {
            Finding::Refuted { witness, of } => witness.refutes(m, *of),
            _ => true,
        })
    }

    // ---------------------------------------------------------------------------------------- what follows

    fn prove(&mut self, class: Class, how: How) {
        self.set(class, Finding::Proven { how });
    }

    /// Takes a refutation up, if it stands.
    fn refute(&mut self, m: &Matrix, class: Class, witness: Witness) {
        if self.is(class) {
            return;
        }
        let refutes = witness.refutes(m, class);
        match &mut self.findings[class as usize] {
            // A witness against the class itself says more than one against a class that contains it.
            Finding::Refuted { of, witness: other } if *of != class && refutes => {
                (*of, *other) = (class, witness);
                return;
            }
            Finding::Refuted { .. } => return,
            _ => {}
        }
        if refutes {
            self.set(class, Finding::Refuted { witness, of: class });
        } else if !self.is_likely(class) {
            self.unsure(class, Why::Rounding);
        }
    }

    fn unsure(&mut self, class: Class, why: Why) {
        if self.get(class).is_unknown() {
            self.findings[class as usize] = Finding::Unknown { why };
        }
    }

    /// Takes a statement up, and all that follows. What was known stays.
    fn set(&mut self, class: Class, finding: Finding) {
        if !self.get(class).is_unknown() {
            debug_assert_eq!(self.is(class), finding.is_proven(), "{class}: {finding:?}");
            return;
        }
        self.findings[class as usize] = finding;
        while let Some((class, finding)) = self.next_implied() {
            self.findings[class as usize] = finding;
        }
    }

    /// A statement that is not known yet and follows from two that are.
    fn next_implied(&self) -> Option<(Class, Finding)> {
        IMPLICATIONS.iter().find_map(|&(premises, conclusion)| {
            let mut open = premises.iter().filter(|c| !self.is(**c));
            let (first, second) = (open.next(), open.next());
            match (first, second, self.get(conclusion)) {
                (None, _, Finding::Unknown { .. }) => Some((
                    conclusion,
                    Finding::Proven { how: How::Follows { from: premises.to_vec() } },
                )),
                (Some(&only), None, refuted @ Finding::Refuted { .. })
                    if self.get(only).is_unknown() =>
                {
                    Some((only, refuted.clone()))
                }
                _ => None,
            }
        })
    }

    // ------------------------------------------------------------------------------------------- the tests

    fn entries(&mut self, m: &Matrix) {
        let n = m.nrows();
        let diagonal = m.diagonal().unwrap_or_default();
        let Seen {
            unlike,
            near,
            above,
            minor,
            negative,
            lone,
            down,
            all_nonnegative,
            positive_in_row,
        } = Seen::in_matrix(m, &diagonal);
        match unlike {
            None => self.prove(Class::Symmetric, How::Entries),
            Some(_) if near => self.unsure(Class::Symmetric, Why::UpToRounding),
            Some((row, column)) => self.refute(m, Class::Symmetric, Witness::Entry { row, column }),
        }
        match above {
            None => self.prove(Class::Z, How::Entries),
            Some((row, column)) => self.refute(m, Class::Z, Witness::Entry { row, column }),
        }
        let least = (0..n).min_by(|&i, &j| diagonal[i].total_cmp(&diagonal[j])).unwrap_or(0);
        if diagonal[least] > 0.0 {
            self.prove(Class::PositiveDiagonal, How::Entries);
        } else {
            if diagonal[least] < 0.0 {
                self.refute(m, Class::P0, Witness::Minor { rows: vec![least] });
                self.refute(m, Class::Copositive, Witness::axis(least));
            }
            self.refute(m, Class::P, Witness::Minor { rows: vec![least] });
            let witness = Witness::Entry { row: least, column: least };
            self.refute(m, Class::PositiveDiagonal, witness);
        }
        if let Some(rows) = negative {
            self.refute(m, Class::P0, Witness::Minor { rows });
        }
        if let Some(rows) = minor {
            self.refute(m, Class::P, Witness::Minor { rows });
        }
        for (class, pair) in [Class::ColumnSufficient, Class::RowSufficient].into_iter().zip(lone) {
            if let Some(pair) = pair {
                let witness = Witness::Transform { pivots: vec![], pair: [pair[0], pair[1]] };
                self.refute(m, class, witness);
            }
        }
        if let Some(x) = down {
            self.refute(m, Class::Copositive, Witness::Direction { x });
        }
        if all_nonnegative && diagonal[least] > 0.0 {
            self.prove(Class::StrictlyCopositive, How::Entries);
        } else if all_nonnegative && diagonal[least] == 0.0 {
            self.prove(Class::Copositive, How::Entries);
        }
        if diagonal[least] >= 0.0 {
            // e_i with M_ii = 0 and another entry in row i of M + Mᵀ.
            let mut flat = None;
            m.for_each(|i, j, _| {
                let k = if diagonal[i] == 0.0 { i } else { j };
                if i != j && diagonal[k] == 0.0 && flat.is_none() && !doubled(m, i, j).is_zero() {
                    flat = Some(k);
                }
            });
            if let Some(k) = flat {
                self.refute(m, Class::CopositivePlus, Witness::axis(k));
            }
        }
        if let Some(row) = positive_in_row.iter().position(|p| !p) {
            self.refute(m, Class::S, Witness::Combination { y: vec![(row, 1.0)] });
        }
    }

    fn dominance(&mut self, m: &Matrix) {
        let slack = slacks(m, false);
        match slack.iter().position(|s| s.is_nonpositive()) {
            Some(row) => self.refute(m, Class::StrictlyDominant, Witness::Row { row }),
            None if slack.iter().all(|s| s.is_positive()) => {
                self.prove(Class::StrictlyDominant, How::Entries);
            }
            None => self.unsure(Class::StrictlyDominant, Why::Rounding),
        }
        if let Some(row) = slack.iter().position(|s| s.is_negative()) {
            self.refute(m, Class::IrreduciblyDominant, Witness::Row { row });
        } else if slack.iter().all(|s| s.is_nonpositive()) {
            self.refute(m, Class::IrreduciblyDominant, Witness::NoStrictRow);
        } else {
            let blocks = strong_components(m);
            let sure = slack.iter().all(|s| s.is_nonnegative());
            if blocks.len() > 1 {
                let rows = blocks.into_iter().next().unwrap_or_default();
                self.refute(m, Class::IrreduciblyDominant, Witness::Block { rows });
            } else if sure && slack.iter().any(|s| s.is_positive()) {
                self.prove(Class::IrreduciblyDominant, How::Entries);
            } else {
                self.unsure(Class::IrreduciblyDominant, Why::Rounding);
            }
        }
        let [row, column] = sums(m);
        if row.iter().all(|s| s.is_positive()) {
            self.prove(Class::S, How::Entries);
        } else if column.iter().all(|s| s.is_nonpositive()) {
            let y = (0..m.nrows()).map(|i| (i, 1.0)).collect();
            self.refute(m, Class::S, Witness::Combination { y });
        }
    }

    fn definite(&mut self, m: &Matrix) {
        if !self.get(Class::PositiveSemidefinite).is_unknown() {
            return;
        }
        let found = definite::decide(m);
        if let Definite::Unknown(_) | Definite::AtLeastSemi(..) = found {
            let diagonal = m.diagonal().unwrap_or_default();
            if let Some(witness) = definite::pair(m, &diagonal, false) {
                self.refute(m, Class::PositiveDefinite, witness);
            }
        }
        match found {
            Definite::Positive(how) => self.prove(Class::PositiveDefinite, how),
            Definite::Semi(how, witness) => {
                self.prove(Class::PositiveSemidefinite, how);
                self.refute(m, Class::PositiveDefinite, witness);
            }
            Definite::AtLeastSemi(how, why) => {
                self.prove(Class::PositiveSemidefinite, how);
                self.unsure(Class::PositiveDefinite, why);
            }
            Definite::Not(witness) => self.refute(m, Class::PositiveSemidefinite, witness),
            Definite::Unknown(why) => {
                self.unsure(Class::PositiveSemidefinite, why);
                // Of a matrix at the edge nobody knows whether it is definite.
                let definite = if why == Why::UpToRounding { Why::Rounding } else { why };
                self.unsure(Class::PositiveDefinite, definite);
                if why == Why::UpToRounding {
                    use Class::*;
                    for class in [
                        P0,
                        CopositivePlus,
                        Copositive,
                        ColumnSufficient,
                        RowSufficient,
                        Sufficient,
                    ] {
                        self.unsure(class, why);
                    }
                }
            }
        }
    }

    fn thorough(&mut self, m: &Matrix, operations: u64) {
        if self.get(Class::HPlus).is_unknown() {
            self.comparison(m);
        }
        self.minors(m, operations);
        self.copositive(m, operations);
        self.sufficient(m, operations);
    }

    /// H₊, block by block.
    fn comparison(&mut self, m: &Matrix) {
        let blocks = strong_components(m);
        let mut cutter = Cutter::new(m);
        let mut all = Ok(());
        for rows in blocks.iter().filter(|rows| rows.len() > 1) {
            let found = match rows.len() {
                n if n == m.nrows() => comparison::decide(m),
                _ => comparison::decide(&cutter.cut(rows)),
            };
            match found {
                Ok(Ok(_)) => {}
                Ok(Err(witness)) => {
                    let witness = match witness {
                        Witness::Comparison { x } => Witness::Comparison {
                            x: x.into_iter().map(|(i, a)| (rows[i], a)).collect(),
                        },
                        Witness::ComparisonMinor { rows: at } => Witness::ComparisonMinor {
                            rows: at.into_iter().map(|i| rows[i]).collect(),
                        },
                        other => other,
                    };
                    return self.refute(m, Class::HPlus, witness);
                }
                Err(why) => all = all.and(Err(why)),
            }
        }
        match all {
            Ok(()) => self.prove(Class::HPlus, How::Comparison),
            Err(why) => self.unsure(Class::HPlus, why),
        }
    }

    /// P and P0, block by block.
    fn minors(&mut self, m: &Matrix, operations: u64) {
        if !self.get(Class::P).is_unknown() && !self.get(Class::P0).is_unknown() {
            return;
        }
        let blocks = strong_components(m);
        let whole = blocks.len() == 1;
        let mut cutter = Cutter::new(m);
        let mut left = operations;
        let (mut p, mut p0) = (Ok(()), Ok(()));
        for rows in blocks {
            if let [i] = rows[..] {
                let d = entry(m, i, i);
                if d < 0.0 {
                    return self.refute(m, Class::P0, Witness::Minor { rows: vec![i] });
                }
                if d == 0.0 {
                    self.refute(m, Class::P, Witness::Minor { rows: vec![i] });
                }
                continue;
            }
            let block = cutter.cut(&rows);
            let mut semidefinite = false;
            if !whole {
                match definite::decide(&block) {
                    Definite::Positive(_) => continue,
                    Definite::Semi(..) | Definite::AtLeastSemi(..) => semidefinite = true,
                    _ => {}
                }
                if semidefinite && self.is_not(Class::P) {
                    continue;
                }
                let positive = block.diagonal().is_some_and(|d| d.iter().all(|d| *d > 0.0));
                if positive && matches!(comparison::decide(&block), Ok(Ok(_))) {
                    continue;
                }
            }
            let found = Minors::of(&block, left);
            let named =
                |at: Vec<usize>| Witness::Minor { rows: at.iter().map(|&a| rows[a]).collect() };
            left = left.saturating_sub(6_u64.saturating_mul(1 << rows.len().min(50)));
            if let Some(at) = found.negative {
                // Of a matrix that is semidefinite up to rounding, negative minors are rounding.
                if self.is_likely(Class::P0) {
                    self.unsure(Class::P, Why::Rounding);
                    return;
                }
                return self.refute(m, Class::P0, named(at));
            }
            if let Some(at) = found.not_positive {
                self.refute(m, Class::P, named(at));
                // A witness that is not accepted proves the contrary no more than it refutes.
                p = p.and(Err(Why::Rounding));
            }
            let why = if found.cut { Why::Operations } else { Why::Rounding };
            if found.doubtful || found.cut {
                p = p.and(Err(why));
                p0 = if semidefinite { p0 } else { p0.and(Err(why)) };
            }
        }
        for (class, found) in [(Class::P, p), (Class::P0, p0)] {
            match found {
                Ok(()) if !self.is_not(class) => self.prove(class, How::Minors),
                Ok(()) => {}
                Err(_) if self.is_likely(class) => {}
                Err(why) => self.unsure(class, why),
            }
        }
    }

    /// Copositive by blocks between which no entry of M + Mᵀ is negative; the other two as a whole.
    fn copositive(&mut self, m: &Matrix, operations: u64) {
        use Class::{Copositive, CopositivePlus, StrictlyCopositive};
        let open = |s: &Self, c: Class| s.get(c).is_unknown();
        if [Copositive, CopositivePlus, StrictlyCopositive].iter().all(|&c| !open(self, c)) {
            return;
        }
        let whole = Submatrices::of(m, operations);
        if !whole.cut {
            if let Some(witness) = whole.negative {
                if self.is_likely(Copositive) {
                    return;
                }
                return self.refute(m, Copositive, witness);
            }
            let [negative, zero] = whole.doubtful;
            // Witnesses that are not accepted prove the contrary no more than they refute.
            let against = [whole.zero.is_some(), whole.moved.is_some()];
            if !negative {
                self.prove(Copositive, How::Submatrices);
            }
            if let Some(witness) = whole.moved {
                self.refute(m, CopositivePlus, witness);
            }
            if let Some(witness) = whole.zero {
                self.refute(m, StrictlyCopositive, witness);
            }
            if !negative && !zero {
                for (class, against) in
                    [StrictlyCopositive, CopositivePlus].into_iter().zip(against)
                {
                    if open(self, class) && !against {
                        self.prove(class, How::Submatrices);
                    }
                }
            }
            for class in [Copositive, CopositivePlus, StrictlyCopositive] {
                if !self.is_likely(class) {
                    self.unsure(class, Why::Rounding);
                }
            }
            return;
        }
        let blocks = components(m, |i, j, x| x + entry(m, j, i) < 0.0);
        let mut cutter = Cutter::new(m);
        let mut left = operations;
        let (mut copositive, mut strictly) = (Ok(()), Ok(()));
        let single = blocks.len() == 1;
        for rows in blocks {
            if let [i] = rows[..] {
                // Negative ones were seen at first.
                if entry(m, i, i) <= 0.0 {
                    strictly = strictly.and(Err(Why::Undecided));
                }
                continue;
            }
            let block = cutter.cut(&rows);
            let definite =
                if single { Definite::Unknown(Why::Undecided) } else { definite::decide(&block) };
            match definite {
                Definite::Positive(_) => continue,
                Definite::Semi(..) | Definite::AtLeastSemi(..) => {
                    strictly = strictly.and(Err(Why::Undecided));
                    continue;
                }
                _ => {}
            }
            let found = Submatrices::of(&block, left);
            left = left.saturating_sub(if found.cut { 0 } else { transforms(rows.len()) });
            let named = |witness: Witness| match witness {
                Witness::Direction { x } => {
                    Witness::Direction { x: x.into_iter().map(|(i, a)| (rows[i], a)).collect() }
                }
                other => other,
            };
            if let Some(witness) = found.negative {
                return self.refute(m, Copositive, named(witness));
            }
            let why = if found.cut { Why::Operations } else { Why::Rounding };
            if found.doubtful[0] || found.cut {
                copositive = copositive.and(Err(why));
            }
            if found.doubtful != [false; 2] || found.cut {
                strictly = strictly.and(Err(why));
            }
            if let Some(witness) = found.zero {
                self.refute(m, StrictlyCopositive, named(witness));
                strictly = strictly.and(Err(Why::Rounding));
            }
        }
        for (class, found) in [(Copositive, copositive), (StrictlyCopositive, strictly)] {
            match found {
                _ if !open(self, class) => {}
                Ok(()) => self.prove(class, How::Submatrices),
                Err(_) if self.is_likely(class) => {}
                Err(why) => self.unsure(class, why),
            }
        }
        if !self.is_likely(CopositivePlus) {
            self.unsure(CopositivePlus, Why::Operations);
        }
    }

    /// Sufficient matrices, by connected components.
    fn sufficient(&mut self, m: &Matrix, operations: u64) {
        use Class::{ColumnSufficient, RowSufficient};
        let sides = [ColumnSufficient, RowSufficient];
        if sides.iter().all(|&c| !self.get(c).is_unknown()) {
            return;
        }
        let mut cutter = Cutter::new(m);
        let mut left = operations;
        let mut found_all = Ok(());
        for rows in components(m, |_, _, _| true) {
            if rows.len() == 1 && entry(m, rows[0], rows[0]) >= 0.0 {
                continue;
            }
            let block = cutter.cut(&rows);
            if rows.len() < m.nrows() && rows.len() > 1 {
                match definite::decide(&block) {
                    Definite::Not(_) | Definite::Unknown(_) => {}
                    _ => continue,
                }
            }
            let found = Transforms::of(&block, left);
            left = left.saturating_sub(if found.cut { 0 } else { transforms(rows.len()) });
            let named = |at: &[usize]| at.iter().map(|&a| rows[a]).collect::<Vec<_>>();
            if let Some(at) = found.negative {
                if !self.is_likely(Class::P0) {
                    self.refute(m, Class::P0, Witness::Minor { rows: named(&at) });
                }
                return;
            }
            let mut against = false;
            for (class, witness) in sides.into_iter().zip(found.against) {
                if let Some(Witness::Transform { pivots, pair }) = witness {
                    let pair = named(&pair);
                    let pivots = named(&pivots);
                    let witness = Witness::Transform { pivots, pair: [pair[0], pair[1]] };
                    against = true;
                    self.refute(m, class, witness);
                }
            }
            if found.cut {
                found_all = found_all.and(Err(Why::Operations));
            } else if found.doubtful {
                found_all = found_all.and(Err(Why::Rounding));
            } else if against {
                // The pairs of transforms prove both or nothing.
                found_all = found_all.and(Err(Why::Undecided));
            }
        }
        for class in sides {
            match found_all {
                _ if !self.get(class).is_unknown() => {}
                Ok(()) => self.prove(class, How::Transforms),
                Err(_) if self.is_likely(class) => {}
                Err(why) => self.unsure(class, why),
            }
        }
        if let (Err(why), false) = (found_all, self.is_likely(Class::Sufficient)) {
            self.unsure(Class::Sufficient, why);
        }
    }
}

/// The operations of a visit of all principal pivotal transforms of n rows.
fn transforms(n: usize) -> u64 {
    ((n * n) as u64) << n.min(40)
}

/// What a walk through the entries and their mirror images meets; of each kind the first.
struct Seen {
    /// An entry that differs from its mirror image, and whether all such differences are rounding.
    unlike: Option<(usize, usize)>,
    near: bool,
    /// A positive entry off the diagonal.
    above: Option<(usize, usize)>,
    /// Rows of a minor that is zero, and of one that is negative.
    minor: Option<Vec<usize>>,
    negative: Option<Vec<usize>>,
    /// An entry without a mirror image beside a zero on the diagonal: against column and row sufficiency.
    lone: [Option<Vec<usize>>; 2],
    /// x ≥ 0 with `xᵀM x < 0`.
    down: Option<Vec<(usize, f64)>>,
    /// Of M + Mᵀ, off the diagonal.
    all_nonnegative: bool,
    positive_in_row: Vec<bool>,
}

impl Seen {
    fn in_matrix(m: &Matrix, diagonal: &[f64]) -> Self {
        /// What of the difference of mirror images is rounding.
        const ROUNDING: f64 = 16.0 * f64::EPSILON;
        let n = m.nrows();
        let (mut unlike, mut near, mut above) = (None, true, None);
        let mut minor: Option<Vec<usize>> = None;
        let mut negative: Option<Vec<usize>> = None;
        let mut lone = [None, None];
        let mut down: Option<Vec<(usize, f64)>> = None;
        let mut all_nonnegative = true;
        let mut positive_in_row = vec![false; n];
        m.for_each(|i, j, x| {
            positive_in_row[i] |= x > 0.0;
            if i == j {
                return;
            }
            let y = entry(m, j, i);
            if x != y && unlike.is_none_or(|_| near) {
                let size = x.abs().max(y.abs()).max((diagonal[i] * diagonal[j]).abs().sqrt());
                let rounding = (x - y).abs() <= ROUNDING * size;
                if unlike.is_none() || !rounding {
                    unlike = Some((i, j));
                    near &= rounding;
                }
            }
            if x > 0.0 && above.is_none() {
                above = Some((i, j));
            }
            let pair = || vec![i.min(j), i.max(j)];
            // Minors of two rows; cheaply first.
            if negative.is_none() && x * y != 0.0 && x * y >= 0.99 * diagonal[i] * diagonal[j] {
                let [a, b, c, d] = [diagonal[i], diagonal[j], x, y].map(Interval::from);
                match Interval::cross(a, b, c, d).sign() {
                    // Of a matrix of rank one the sign is a matter of rounding.
                    Some(Ordering::Less)
                        if x * y > (1.0 + ROUNDING) * diagonal[i] * diagonal[j] =>
                    {
                        negative = Some(pair());
                    }
                    Some(Ordering::Equal) if minor.is_none() => minor = Some(pair()),
                    _ => {}
                }
            }
            if y == 0.0 && x != 0.0 {
                let (r, c) = (i, j);
                for (side, k) in [c, r].into_iter().enumerate() {
                    if diagonal[k] == 0.0 && lone[side].is_none() {
                        lone[side] = Some(pair());
                    }
                }
            }
            let s = x + y;
            all_nonnegative &= s >= 0.0;
            if s < 0.0 && down.is_none() {
                // sqrt(M_jj) e_i + sqrt(M_ii) e_j, or a step along e_j first where that bends nothing.
                let (a, b) = (diagonal[i].max(0.0), diagonal[j].max(0.0));
                let weights = match (a == 0.0, b == 0.0) {
                    (false, false) => [b.sqrt(), a.sqrt()],
                    (true, false) => [2.0 * b / -s, 1.0],
                    (false, true) => [1.0, 2.0 * a / -s],
                    (true, true) => [1.0, 1.0],
                };
                let mut x = vec![(i, weights[0]), (j, weights[1])];
                x.sort_by_key(|e| e.0);
                if a.sqrt() * b.sqrt() * 2.0 * (1.0 + ROUNDING) < -s
                    && (Witness::Direction { x: x.clone() }).refutes(m, Class::Copositive)
                {
                    down = Some(x);
                }
            }
        });
        Self { unlike, near, above, minor, negative, lone, down, all_nonnegative, positive_in_row }
    }
}

/// `M e` and `Mᵀ e`.
fn sums(m: &Matrix) -> [Vec<Interval>; 2] {
    let mut sums = [vec![Interval::ZERO; m.nrows()], vec![Interval::ZERO; m.nrows()]];
    m.for_each(|i, j, x| {
        sums[0][i] += x.into();
        sums[1][j] += x.into();
    });
    sums
}

impl std::fmt::Display for Classes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}

impl Serialize for Classes {
    /// A map from classes to findings.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.findings.len()))?;
        for (class, finding) in self.iter() {
            map.serialize_entry(&class, finding)?;
        }
        map.end()
    }
}
