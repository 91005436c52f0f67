//! Bimatrix games as complementarity problems, recognised whatever the order of the strategies and the scales of the rows: costs `K, L ≥ 0` with
//! `0 ≤ x ⟂ K y − p ≥ 0`, `0 ≤ y ⟂ Lᵀ x − r ≥ 0`, p, r > 0; and the mixed problem with a free variable for the value of each player.

use nonsmooth_linalg::{Dense, Matrix};

use crate::complementarity::form::{Complementary, System};

/// Strategies of the two players; each sums up to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Of the row player, m.
    pub x: Vec<f64>,
    /// Of the column player, n.
    pub y: Vec<f64>,
}

/// A game that a complementarity problem states.
pub struct Game {
    /// The variables that are strategies of the row and of the column player.
    pub strategies: [Vec<usize>; 2],
    /// What each strategy costs against each of the other player's, by its own row: over the right-hand side where the problem is an LCP.
    costs: [Dense; 2],
    /// Of a mixed problem, for each player.
    values: Option<[Value; 2]>,
}

/// The free variable that stands for what a player gets, and the equality of the strategies: `0 ≤ x ⟂ d v + (M z) ≥ 0`, `Σ x = sum`.
struct Value {
    variable: usize,
    coefficient: f64,
    sum: f64,
}

/// The entries of a problem's matrix that are not zero, by rows; as long as there are no more than a game has.
fn by_rows(m: &Matrix) -> Option<Vec<Vec<(usize, f64)>>> {
    let mut rows = vec![vec![]; m.nrows()];
    let known = m.for_each(|i, j, x| {
        if x != 0.0 {
            rows[i].push((j, x));
        }
    });
    known.then_some(rows)
}

/// Whether the problem may be a game, by a look at the right-hand side and at the diagonal.
fn is_plausible(system: &System) -> bool {
    let (q, free) = (system.q, system.free());
    let negative = |q: &f64| *q < 0.0;
    let right = match free {
        0 => q.len() >= 2 && q.iter().all(negative),
        2 => q.len() >= 4 && q[..2].iter().all(|q| *q != 0.0) && q[2..].iter().all(|q| *q == 0.0),
        _ => false,
    };
    right && system.matrix.diagonal().is_some_and(|d| d.iter().all(|d| *d == 0.0))
}

/// What is no game, and what is several: an equilibrium of all may leave one of them out, and is then no solution.
const OTHER: &str = "another problem";
const PARTS: &str = "games that have no strategy in common, each a problem of its own";

impl Game {
    /// The game, if the problem is one; else what it is.
    pub fn of(system: &System) -> Result<Self, &'static str> {
        if !is_plausible(system) {
            return Err(OTHER);
        }
        let rows = by_rows(system.matrix).ok_or(OTHER)?;
        match system.free() {
            0 => Self::of_costs(&rows, system.q),
            _ => Self::with_values(&rows, system.q).ok_or(OTHER),
        }
    }

    /// `M = [0 K; Lᵀ 0]` in some order: the graph of its entries has two sides.
    fn of_costs(rows: &[Vec<(usize, f64)>], q: &[f64]) -> Result<Self, &'static str> {
        let n = q.len();
        // A strategy may cost nothing by its own row, and be told by the others'.
        let mut columns = vec![vec![]; n];
        for (i, row) in rows.iter().enumerate() {
            row.iter().for_each(|&(j, x)| columns[j].push((i, x)));
        }
        let mut side: Vec<Option<usize>> = vec![None; n];
        let mut parts = 0;
        for first in 0..n {
            if side[first].is_some() {
                continue;
            }
            // A strategy that meets no other is none.
            if rows[first].is_empty() && columns[first].is_empty() {
                return Err(OTHER);
            }
            parts += 1;
            side[first] = Some(0);
            let mut left = vec![(first, 0)];
            while let Some((i, own)) = left.pop() {
                for &(j, x) in rows[i].iter().chain(&columns[i]) {
                    match side[j] {
                        _ if x < 0.0 => return Err(OTHER),
                        None => {
                            side[j] = Some(1 - own);
                            left.push((j, 1 - own));
                        }
                        Some(s) if s == own => return Err(OTHER),
                        Some(_) => {}
                    }
                }
            }
        }
        if parts > 1 {
            return Err(PARTS);
        }
        let of = |s| (0..n).filter(|&i| side[i] == Some(s)).collect::<Vec<_>>();
        let strategies = [of(0), of(1)];
        // A row over its right-hand side is the same condition.
        let costs = costs(rows, &strategies, |i, x| x / -q[i]);
        Ok(Self { strategies, costs, values: None })
    }

    /// `0 ≤ x ⟂ d₁ v₁ + K y ≥ 0`, `0 ≤ y ⟂ d₂ v₂ + Lᵀ x ≥ 0`, `Σ x = s₁`, `Σ y = s₂`; K and L of any signs, d₁ and d₂ not zero.
    fn with_values(rows: &[Vec<(usize, f64)>], q: &[f64]) -> Option<Self> {
        let n = q.len();
        // Each equality has the same coefficient for all strategies of one player, and no other entry.
        let mut sums = [0.0; 2];
        let mut strategies = [vec![], vec![]];
        for e in 0..2 {
            let &(_, c) = rows[e].first()?;
            if rows[e].iter().any(|&(j, x)| j < 2 || x != c) {
                return None;
            }
            strategies[e] = rows[e].iter().map(|e| e.0).collect();
            strategies[e].sort_unstable();
            sums[e] = -q[e] / c;
        }
        let mut owner = vec![None; n];
        for (e, all) in strategies.iter().enumerate() {
            for &i in all {
                if owner[i].replace(e).is_some() {
                    return None;
                }
            }
        }
        // The rows of a player have one free variable, with one coefficient, and the other player's strategies.
        let mut values: [Option<(usize, f64)>; 2] = [None; 2];
        for i in 2..n {
            let e = owner[i]?;
            let mut free = rows[i].iter().filter(|(j, _)| *j < 2);
            let &value = free.next()?;
            let apart = rows[i].iter().all(|&(j, _)| j < 2 || owner[j] == Some(1 - e));
            if free.next().is_some() || !apart || *values[e].get_or_insert(value) != value {
                return None;
            }
        }
        let [Some(first), Some(second)] = values else { return None };
        if first.0 == second.0 || sums.iter().any(|s| *s <= 0.0) {
            return None;
        }
        let value = |(variable, coefficient), sum| Value { variable, coefficient, sum };
        let values = Some([value(first, sums[0]), value(second, sums[1])]);
        let costs = costs(rows, &strategies, |_, x| x);
        Some(Self { strategies, costs, values })
    }

    /// Payoffs `A`, `B` of the game, m × n.
    pub fn payoffs(&self) -> (Dense, Dense) {
        let [k, l] = &self.costs;
        let (m, n) = (k.nrows(), k.ncols());
        (Dense::from_fn(m, n, |i, j| -k[(i, j)]), Dense::from_fn(m, n, |i, j| -l[(j, i)]))
    }

    /// The solution of the problem that an equilibrium is; false where there is none, because a player has nothing to pay.
    pub fn solution(&self, e: &Equilibrium, z: &mut [f64]) -> bool {
        let shares = [&e.x, &e.y];
        // What the best answers of each player cost.
        let least = |player: usize| {
            let costs = &self.costs[player];
            let mut all = vec![0.0; costs.nrows()];
            costs.mul_add(1.0, shares[1 - player], &mut all);
            let used = all.iter().zip(shares[player]).filter(|e| *e.1 > 0.0).map(|e| *e.0);
            used.fold(f64::INFINITY, f64::min)
        };
        let costs = [least(0), least(1)];
        for player in 0..2 {
            let scale = match &self.values {
                // The strategies of a player are scaled by what the other one pays.
                None if costs[1 - player] > 0.0 => 1.0 / costs[1 - player],
                None => return false,
                Some(values) => values[player].sum,
            };
            for (&i, share) in self.strategies[player].iter().zip(shares[player]) {
                z[i] = share * scale;
            }
            if let Some(values) = &self.values {
                let Value { variable, coefficient, .. } = values[player];
                z[variable] = -costs[player] * values[1 - player].sum / coefficient;
            }
        }
        true
    }
}

fn costs(
    rows: &[Vec<(usize, f64)>],
    strategies: &[Vec<usize>; 2],
    cost: impl Fn(usize, f64) -> f64,
) -> [Dense; 2] {
    let mut place = vec![0; rows.len()];
    strategies.iter().for_each(|all| all.iter().enumerate().for_each(|(k, &i)| place[i] = k));
    [0, 1].map(|player| {
        let (own, others) = (&strategies[player], &strategies[1 - player]);
        let mut out = Dense::zeros(own.len(), others.len());
        for (k, &i) in own.iter().enumerate() {
            for &(j, x) in &rows[i] {
                // The column of a value is no strategy.
                if others.get(place[j]) == Some(&j) {
                    out[(k, place[j])] = cost(i, x);
                }
            }
        }
        out
    })
}

/// Whether a problem states a game.
pub fn is_game<P: Complementary>(problem: &P) -> bool {
    problem.system().is_ok_and(|system| Game::of(&system).is_ok())
}
