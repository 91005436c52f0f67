//! Is there a solution? Decided exactly, from the data as stored, for problems that are a union of polyhedra.
//!
//! A problem is a list of affine forms of free parameters. Some forms are zero always; and of each *choice* (a complementary pair, a
//! contact of the plane) one *cell* must hold: these forms zero, those not negative. The cells are enumerated depth first; each
//! equation eliminates a parameter in whole numbers (fraction-free, so that all entries stay minors of the data), and what is left of
//! the parameters at a leaf is a linear program, decided by pivots of least index. Whole numbers of 128 bits first, of any length where these overflow.

use num_bigint::{BigInt, Sign};

use super::exact::parts;

/// One way to meet a choice.
#[derive(Debug, Clone, Default)]
pub struct Cell {
    /// Forms that vanish.
    pub zero: Vec<usize>,
    /// Forms that, times the sign, are not negative.
    pub nonnegative: Vec<(usize, i8)>,
}

/// A union of polyhedra: see the module.
#[derive(Debug, Clone, Default)]
pub struct Union {
    /// The parameters.
    pub width: usize,
    /// The coefficients of each form, then its constant.
    pub forms: Vec<Vec<f64>>,
    /// Forms that vanish always.
    pub zero: Vec<usize>,
    /// Of each, one cell holds.
    pub choices: Vec<Vec<Cell>>,
}

impl Union {
    pub fn new(width: usize) -> Self {
        Self { width, ..Self::default() }
    }

    /// A form, by its entries and its constant; its number.
    pub fn form(&mut self, entries: &[(usize, f64)], constant: f64) -> usize {
        let mut row = vec![0.0; self.width + 1];
        for &(j, a) in entries {
            assert!(a == 0.0 || row[j] == 0.0, "one entry a place");
            row[j] += a;
        }
        row[self.width] = constant;
        self.forms.push(row);
        self.forms.len() - 1
    }

    /// `0 ≤ a ⟂ b ≥ 0`.
    pub fn pair(&mut self, a: usize, b: usize) {
        let cell = |zero, other| Cell { zero: vec![zero], nonnegative: vec![(other, 1)] };
        self.choices.push(vec![cell(a, b), cell(b, a)]);
    }

    /// Leaves below the root.
    pub fn leaves(&self) -> f64 {
        self.choices.iter().map(|c| c.len() as f64).product()
    }

    /// Whether the union is not empty.
    pub fn has_point(&self) -> bool {
        let whole = self.whole();
        let short = whole
            .iter()
            .map(|row| {
                row.iter().map(|&(m, shift)| i128::from(m).checked_mul(power(shift)?)).collect()
            })
            .collect::<Option<Vec<Vec<i128>>>>();
        if let Some(found) = short.and_then(|rows| self.search(rows)) {
            return found;
        }
        let long = |&(m, shift): &(i64, u32)| BigInt::from(m) << shift;
        let rows = whole.iter().map(|row| row.iter().map(long).collect()).collect();
        self.search::<BigInt>(rows).expect("any length will do")
    }

    /// The forms in whole numbers `m 2^shift`: rows and columns scaled by powers of two, which changes neither zeros nor signs, if the
    /// constants are taken as the column of one more parameter that is positive.
    fn whole(&self) -> Vec<Vec<(i64, u32)>> {
        let all: Vec<Vec<(i64, i32)>> =
            self.forms.iter().map(|row| row.iter().map(|&x| parts(x)).collect()).collect();
        let mut exponents = all.clone();
        let entries =
            |row: &[(i64, i32)]| row.iter().filter(|p| p.0 != 0).map(|p| p.1).min().unwrap_or(0);
        for _ in 0..6 {
            for row in &mut exponents {
                let least = entries(row);
                row.iter_mut().for_each(|p| p.1 -= least);
            }
            for j in 0..=self.width {
                let column: Vec<_> = exponents.iter().map(|row| row[j]).collect();
                let least = entries(&column);
                exponents.iter_mut().for_each(|row| row[j].1 -= least);
            }
        }
        let shift = |p: &(i64, i32)| (p.0, if p.0 == 0 { 0 } else { p.1 as u32 });
        exponents.iter().map(|row| row.iter().map(shift).collect()).collect()
    }

    fn search<T: Whole>(&self, rows: Vec<Vec<T>>) -> Option<bool> {
        let mut live = vec![false; self.forms.len()];
        for cell in self.choices.iter().flatten() {
            cell.zero.iter().for_each(|&i| live[i] = true);
            cell.nonnegative.iter().for_each(|&(i, _)| live[i] = true);
        }
        let rows = rows.into_iter().map(Some).collect();
        let mut state = State { rows, divisor: T::one(), asked: vec![] };
        for &i in &self.zero {
            if !state.vanish(i)? {
                return Some(false);
            }
            state.rows[i] = if live[i] { state.rows[i].take() } else { None };
        }
        // The last choice that a form occurs in: it is dropped after it.
        let mut last = vec![0; self.forms.len()];
        for (depth, choice) in self.choices.iter().enumerate() {
            for cell in choice {
                cell.zero.iter().for_each(|&i| last[i] = depth);
                cell.nonnegative.iter().for_each(|&(i, _)| last[i] = depth);
            }
        }
        self.descend(&state, 0, &last)
    }

    fn descend<T: Whole>(&self, state: &State<T>, depth: usize, last: &[usize]) -> Option<bool> {
        let Some(choice) = self.choices.get(depth) else {
            return state.polyhedron();
        };
        for cell in choice {
            let mut next = state.clone();
            let mut possible = true;
            for &i in &cell.zero {
                if !next.vanish(i)? {
                    possible = false;
                    break;
                }
            }
            if !possible {
                continue;
            }
            next.asked.extend(&cell.nonnegative);
            for i in 0..last.len() {
                if last[i] == depth && !next.asked.iter().any(|a| a.0 == i) {
                    next.rows[i] = None;
                }
            }
            if next.holds() && self.descend(&next, depth + 1, last)? {
                return Some(true);
            }
        }
        Some(false)
    }
}

/// Whole numbers in which a result may be too large: `None`.
trait Whole: Clone {
    fn one() -> Self;
    fn sign(&self) -> i8;
    fn negated(&self) -> Option<Self>;
    /// `(a b − c d) / e`, which leaves no rest.
    fn minor(a: &Self, b: &Self, c: &Self, d: &Self, e: &Self) -> Option<Self>;
}

fn power(shift: u32) -> Option<i128> {
    (shift < 100).then(|| 1_i128 << shift)
}

impl Whole for i128 {
    fn one() -> Self {
        1
    }
    fn sign(&self) -> i8 {
        self.signum() as i8
    }
    fn negated(&self) -> Option<Self> {
        self.checked_neg()
    }
    fn minor(a: &Self, b: &Self, c: &Self, d: &Self, e: &Self) -> Option<Self> {
        let left = if *b == 0 { 0 } else { a.checked_mul(*b)? };
        let right = if *c == 0 || *d == 0 { 0 } else { c.checked_mul(*d)? };
        let all = left.checked_sub(right)?;
        if *e == 1 || all == 0 {
            return Some(all);
        }
        // Most numbers are short, and their division much faster.
        match (i64::try_from(all), i64::try_from(*e)) {
            (Ok(all), Ok(e)) if e != -1 => Some(i128::from(all / e)),
            _ => Some(all / e),
        }
    }
}

impl Whole for BigInt {
    fn one() -> Self {
        1.into()
    }
    fn sign(&self) -> i8 {
        match BigInt::sign(self) {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }
    fn negated(&self) -> Option<Self> {
        Some(-self)
    }
    fn minor(a: &Self, b: &Self, c: &Self, d: &Self, e: &Self) -> Option<Self> {
        Some((a * b - c * d) / e)
    }
}

/// The forms that are still of use, in the parameters that are left, times the divisor.
#[derive(Clone)]
struct State<T> {
    rows: Vec<Option<Vec<T>>>,
    /// Positive.
    divisor: T,
    /// Forms that must not be negative, with their signs.
    asked: Vec<(usize, i8)>,
}

impl<T: Whole> State<T> {
    /// Makes form i zero by eliminating a parameter; false where it cannot be.
    fn vanish(&mut self, i: usize) -> Option<bool> {
        let row = self.rows[i].clone().expect("a form of use");
        let width = row.len() - 1;
        let Some(k) = (0..width).find(|&k| row[k].sign() != 0) else {
            return Some(row[width].sign() == 0);
        };
        let pivot = &row[k];
        for other in self.rows.iter_mut().flatten() {
            for j in 0..=width {
                if j != k {
                    other[j] = T::minor(pivot, &other[j], &other[k], &row[j], &self.divisor)?;
                }
            }
            other.remove(k);
        }
        if pivot.sign() < 0 {
            for other in self.rows.iter_mut().flatten() {
                for x in other.iter_mut() {
                    *x = x.negated()?;
                }
            }
            self.divisor = pivot.negated()?;
        } else {
            self.divisor = pivot.clone();
        }
        Some(true)
    }

    /// No form that must not be negative is so already.
    fn holds(&self) -> bool {
        self.asked.iter().all(|&(i, sign)| {
            let row = self.rows[i].as_ref().expect("a form of use");
            let (constant, others) = row.split_last().expect("a constant");
            constant.sign() * sign >= 0 || others.iter().any(|x| x.sign() != 0)
        })
    }

    /// Whether the asked forms can all be nonnegative: free parameters are exchanged for forms, then the forms are made nonnegative one by one.
    /// Without an objective every pivot of the dual simplex method is allowed, and the least index makes it finite.
    fn polyhedron(&self) -> Option<bool> {
        let mut rows: Vec<Vec<T>> = vec![];
        for &(i, sign) in &self.asked {
            let row = self.rows[i].as_ref().expect("a form of use");
            let signed = |x: &T| if sign < 0 { x.negated() } else { Some(x.clone()) };
            rows.push(row.iter().map(signed).collect::<Option<_>>()?);
        }
        let Some(width) = rows.first().map(|row| row.len() - 1) else { return Some(true) };
        let mut divisor = self.divisor.clone();
        // The form that stands in each row and in each column; free parameters have no name.
        let mut basic: Vec<usize> = (0..rows.len()).collect();
        let mut columns: Vec<Option<usize>> = vec![None; width];
        for k in 0..width {
            let Some(i) = (0..rows.len()).find(|&i| rows[i][k].sign() != 0) else { continue };
            exchange(&mut rows, &mut divisor, i, k)?;
            columns[k] = Some(basic.remove(i));
            // The free parameter may be anything.
            rows.remove(i);
        }
        loop {
            let negative = (0..rows.len()).filter(|&i| rows[i][width].sign() < 0);
            let Some(i) = negative.min_by_key(|&i| basic[i]) else { return Some(true) };
            let may = |k: &usize| columns[*k].is_some() && rows[i][*k].sign() > 0;
            let Some(k) = (0..width).filter(may).min_by_key(|&k| columns[k]) else {
                return Some(false);
            };
            exchange(&mut rows, &mut divisor, i, k)?;
            let entering = columns[k].replace(basic[i]).expect("a form");
            basic[i] = entering;
        }
    }
}

/// Row i and column k change places.
fn exchange<T: Whole>(rows: &mut [Vec<T>], divisor: &mut T, i: usize, k: usize) -> Option<()> {
    let row = rows[i].clone();
    let pivot = &row[k];
    for (r, other) in rows.iter_mut().enumerate() {
        for j in 0..other.len() {
            if r == i {
                other[j] = if j == k { divisor.clone() } else { row[j].negated()? };
            } else if j != k {
                other[j] = T::minor(pivot, &other[j], &other[k], &row[j], divisor)?;
            }
        }
    }
    let flip = pivot.sign() < 0;
    *divisor = if flip { pivot.negated()? } else { pivot.clone() };
    if flip {
        for x in rows.iter_mut().flatten() {
            *x = x.negated()?;
        }
    }
    Some(())
}
