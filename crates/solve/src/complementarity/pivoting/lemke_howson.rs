//! **Lemke–Howson**: one equilibrium of a bimatrix game, by complementary pivots from the artificial one.
//!
//! Problem: payoffs A and B, m × n, of a row and a column player. Mixed strategies (x, y) such that neither gains by another one:
//! `xᵀ A y ≥ x'ᵀ A y`, `xᵀ B y ≥ xᵀ B y'`. As complementarity problems games come in two shapes, which are recognised whatever the order of the strategies and the
//! scales of the rows: costs `K, L ≥ 0` with `0 ≤ x ⟂ K y − p ≥ 0`, `0 ≤ y ⟂ Lᵀ x − r ≥ 0` and p, r > 0 (an LCP with `M = [0 K; Lᵀ 0]`), whose x and y are strategies over
//! their costs; and the mixed problem in which a free variable stands for the value of each player and an equality says that the strategies add up.
//!
//! Method: with payoffs made positive, an equilibrium is a solution other than zero of the LCP with `M = [0 −A; −Bᵀ 0]`, `q = 1`: w are the slacks of
//! `A y ≤ 1`, `Bᵀ x ≤ 1`, and x, y are scaled to sum up to 1 at last. From `z = 0` a z_k is made basic (the label k is dropped), and complementary pivots follow until
//! z_k or w_k leaves. The polytopes are bounded, so nothing is a ray; ties go lexicographically. Each label leads to an equilibrium, not always to another one.
//!
//! References: LemkeHowson1964; CottlePangStone2009, section 4.4.
//!
//! Cost of a pivot: that of Lemke's method. Storage: as there.
//! Fails: exponentially many pivots at worst; equilibria that no label reaches from the artificial one.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{Lcp, LcpPoint};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::basis::{Basis, Data, Factored, Tableau};
use super::path::{Breaking, End, Event, Exchange, Path};
use crate::complementarity::form::{Bounded, Complementary, system};
use crate::complementarity::parts::game::{Equilibrium, Game};
use crate::complementarity::parts::refuting_row;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::{Pivot, Recorder, Trace, Variable};
use crate::{SolveError, Solver, Step};

/// Beyond this, the basis is factorised.
const TABLEAU_LIMIT: usize = 60;

/// The LCP of a game with payoffs `a` and `b` (m × n, made positive): every solution other than zero, scaled, is an equilibrium.
///
/// Errors: payoffs of different shapes, empty or not finite.
pub fn game(a: &Dense, b: &Dense) -> Result<Lcp, SolveError> {
    let (m, n) = (a.nrows(), a.ncols());
    if (b.nrows(), b.ncols()) != (m, n) || m * n == 0 {
        let found = format!("{m} × {n} and {} × {}", b.nrows(), b.ncols());
        return Err(SolveError::needs("payoffs of one shape, with a row and a column", found));
    }
    // Payoffs from 1 to 2: equilibria do not depend on units.
    let unit = |p: &Dense| {
        let least = p.values().iter().copied().fold(f64::INFINITY, f64::min);
        let most = p.values().iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (least, if most > least { most - least } else { 1.0 })
    };
    let ((la, ra), (lb, rb)) = (unit(a), unit(b));
    let entry = |i: usize, j: usize| match (i < m, j < m) {
        (true, false) => -1.0 - (a[(i, j - m)] - la) / ra,
        (false, true) => -1.0 - (b[(j, i - m)] - lb) / rb,
        _ => 0.0,
    };
    Ok(Lcp::new(Dense::from_fn(m + n, m + n, entry), vec![1.0; m + n])?)
}

/// The path from the artificial equilibrium.
struct Walk {
    path: Path,
    /// Strategies of the row player.
    rows: usize,
}

impl Walk {
    fn new(a: &Dense, b: &Dense) -> Result<Self, SolveError> {
        let lcp = game(a, b)?;
        let basis: Box<dyn Basis> = if lcp.dim() <= TABLEAU_LIMIT {
            Box::new(Tableau::default())
        } else {
            Box::new(Factored::default())
        };
        let mut path = Path::new(Data::new(&lcp.system()?, true), basis);
        path.breaking = Breaking::Lexicographic;
        Ok(Self { path, rows: a.nrows() })
    }

    /// Goes back to the artificial equilibrium and drops label k.
    fn begin(&mut self, k: usize) -> Result<(), &'static str> {
        self.path.end = End::Pair(k);
        self.path.place(&vec![false; self.path.data.n])?;
        self.path.drive(Variable::Z(k));
        Ok(())
    }

    /// What the last basis says. `None` where rounding has spoiled it.
    fn equilibrium(&mut self) -> Option<Equilibrium> {
        self.path.refine().ok()?;
        let mut z = vec![0.0; self.path.data.n];
        for (&v, &x) in self.path.basic.iter().zip(&self.path.x) {
            if let Variable::Z(j) = v {
                z[j] = x.max(0.0) * self.path.unit(v);
            }
        }
        let share = |part: &[f64]| {
            let sum: f64 = part.iter().sum();
            (sum > 0.0).then(|| part.iter().map(|z| z / sum).collect::<Vec<_>>())
        };
        // x and y are not both zero, and where one is not, neither is the other.
        let (x, y) = z.split_at(self.rows);
        share(x).zip(share(y)).map(|(x, y)| Equilibrium { x, y })
    }
}

/// The equilibrium to which label `k` leads: `k < m` a row of the row player, else a column. `None` where rounding spoils the path.
///
/// Errors: as [`game`]; a label that does not exist.
pub fn lemke_howson(a: &Dense, b: &Dense, k: usize) -> Result<Option<Equilibrium>, SolveError> {
    let mut walk = Walk::new(a, b)?;
    if k >= walk.path.data.n {
        return Err(SolveError::needs("a label below the number of strategies", k.to_string()));
    }
    if walk.begin(k).is_err() {
        return Ok(None);
    }
    loop {
        match walk.path.pivot() {
            Event::Pivoted(_) => {}
            Event::Ended(_) => return Ok(walk.equilibrium()),
            Event::Ray | Event::Trouble(_) => return Ok(None),
        }
    }
}

/// Which label is dropped first.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LemkeHowson {
    /// The strategy whose label is dropped, counted over those of the row and then of the column player; where its path is spoiled by rounding the next ones follow.
    pub label: usize,
}

impl Settings for LemkeHowson {}

impl Described for LemkeHowson {
    const ABOUT: &'static About = &About {
        name: "lemke_howson",
        family: "pivoting",
        solves: Solves::Law,
        summary: "Lemke–Howson: complementary pivots to an equilibrium of a bimatrix game",
        needs: &[
            "a bimatrix game: M = [0 K; Lᵀ 0], K, L ≥ 0, q < 0, in any order; or its mixed form with the players' values",
        ],
        cites: &["LemkeHowson1964", "CottlePangStone2009"],
        variants: &[],
        settings: described::<Self>,
    };
}

/// The game, and the path on it.
pub struct LemkeHowsonWork {
    game: Game,
    walk: Walk,
    /// The label that is dropped, and how many were before.
    label: usize,
    tried: usize,
    /// Whether the path has begun.
    begun: bool,
    pivots: usize,
    z: Option<Vec<f64>>,
    /// A row that refutes the problem.
    refuting: Option<usize>,
    record: Recorder<Pivot>,
}

impl LemkeHowsonWork {
    /// The path of this label has come to nothing: the next one.
    fn next(&mut self) -> Step {
        let labels = self.walk.path.data.n;
        self.tried += 1;
        self.label = (self.label + 1) % labels;
        self.begun = false;
        match self.tried < labels {
            true => Step::Continue { estimate: f64::NAN },
            // An equilibrium in which a player has nothing to pay is no solution, and rounding may spoil a path.
            false => Step::Stuck("no label leads to an equilibrium that is a solution".into()),
        }
    }

    fn keep(&mut self, exchange: Exchange) {
        self.pivots += 1;
        let Exchange { entering, leaving, ratio } = exchange;
        self.record.push(Pivot { iteration: self.pivots, entering, leaving, ratio, z0: None });
    }
}

impl<P: Complementary> Solver<P> for LemkeHowson {
    type Work = LemkeHowsonWork;

    fn work(&self, problem: &P) -> Result<LemkeHowsonWork, SolveError> {
        let none = |found| SolveError::needs("a bimatrix game (see `nonsmooth list`)", found);
        let system = problem.system()?;
        let game = Game::of(&system).map_err(none)?;
        let refuting = refuting_row(&system, &mut vec![]);
        let (a, b) = game.payoffs();
        let walk = Walk::new(&a, &b)?;
        let labels = walk.path.data.n;
        if self.label >= labels {
            let found = format!("{} of {labels}", self.label);
            return Err(SolveError::needs("a label below the number of strategies", found));
        }
        Ok(LemkeHowsonWork {
            game,
            walk,
            label: self.label,
            tried: 0,
            begun: false,
            pivots: 0,
            z: None,
            refuting,
            record: Recorder::default(),
        })
    }

    fn start(&self, _: &P, _: &mut LcpPoint, work: &mut LemkeHowsonWork) {
        (work.label, work.tried, work.begun, work.pivots) = (self.label, 0, false, 0);
        work.z = None;
    }

    fn step(&self, problem: &P, _: &mut LcpPoint, work: &mut LemkeHowsonWork) -> Step {
        if let Some(row) = work.refuting {
            return Step::NoSolution(Certificate::Row { row });
        }
        if !work.begun {
            if work.walk.begin(work.label).is_err() {
                return work.next();
            }
            work.begun = true;
        }
        match work.walk.path.pivot() {
            Event::Pivoted(exchange) => {
                work.keep(exchange);
                Step::Continue { estimate: f64::NAN }
            }
            Event::Ended(exchange) => {
                work.keep(exchange);
                let mut z = vec![0.0; system(problem).dim()];
                let found = work.walk.equilibrium();
                match found.is_some_and(|e| work.game.solution(&e, &mut z)) {
                    true => {
                        work.z = Some(z);
                        Step::Done
                    }
                    false => work.next(),
                }
            }
            Event::Ray | Event::Trouble(_) => work.next(),
        }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut LemkeHowsonWork) {
        if let Some(z) = &work.z {
            point.z.copy_from_slice(z);
        }
    }

    fn record(&self, on: bool, work: &mut LemkeHowsonWork) {
        work.record.begin(on);
    }

    fn trace(&self, work: &LemkeHowsonWork) -> Trace {
        Trace::Pivots(work.record.rows())
    }

    fn account(&self, work: &LemkeHowsonWork) -> Vec<String> {
        let [x, y] = &work.game.strategies;
        vec![format!(
            "{} pivots, from label {}, in a game of {} × {} strategies",
            work.pivots,
            work.label,
            x.len(),
            y.len()
        )]
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        super::CHECK_EVERY
    }
}
