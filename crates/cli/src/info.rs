//! `nonsmooth info`.

use std::path::{Path, PathBuf};

use nonsmooth_io::fclib::{self, FclibFile};
use nonsmooth_problem::linalg::{Bsr, Csc, Inverse};
use nonsmooth_problem::{
    Dynamics, Friction, FrictionGlobal, FrictionLocal, ProblemError, with_friction,
};
use serde_json::{Value, json};

use crate::kinds::Form;
use crate::report::{self, Object, count, number, row};
use crate::{Exit, files, output};

/// Describe the problems in files: sizes, structure, friction, and what is stored besides.
///
/// The contact density is c = D nc / n, the components of the contact impulses over the degrees of freedom:
/// above 1 the impulses need not be unique (hyperstatic), and iterative solvers slow down.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// FCLIB files (HDF5)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print one line of JSON for each file
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth info wall.hdf5
  nonsmooth info *.hdf5 --json";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    Ok(files::each(&args.files, args.json, |_, file| {
        let content = fclib::read(file).map_err(|e| e.to_string())?;
        let facts = with_friction!(&content.problem, p => facts(file, p, &content))?;
        output::print(&if args.json {
            format!("{}\n", facts.json(&content))
        } else {
            facts.text(file, &content)
        });
        Ok(Exit::Solved)
    }))
}

/// What there is to say of a problem.
struct Facts {
    sizes: Object,
    size_text: String,
    dofs: Option<usize>,
    dimension: usize,
    operator: Operator,
    pattern: Pattern,
    multipliers: usize,
    solution: Option<nonsmooth_problem::check::Verdict>,
}

/// The matrix of the problem.
enum Operator {
    /// W is stored.
    Delassus { asymmetry: f64 },
    /// M and H are stored.
    Mass {
        asymmetry: f64,
        entries: usize,
        entries_of_h: usize,
        /// `(size, how many)` of the connected components.
        components: Vec<(usize, usize)>,
        /// Why it cannot be inverted, so that there is nothing to solve.
        singular: Option<ProblemError>,
    },
}

/// The block structure of W: which contacts feel which.
struct Pattern {
    blocks: usize,
    least: usize,
    most: usize,
    contacts: usize,
    groups: usize,
}

fn facts<P: Form>(file: &Path, problem: &P, content: &FclibFile) -> Result<Facts, String> {
    let judge = |stored| problem.judge(&problem.point(stored), JUDGED_AT);
    let solution = match content.solution.as_ref().map(judge).transpose() {
        // Said of M.
        Err(ProblemError::Singular { .. }) => None,
        judged => judged.map_err(|e| format!("{}: {e}", file.display()))?,
    };
    let dofs = content.info.dofs;
    let (dimension, dofs, operator, pattern, multipliers) = match &content.problem {
        Friction::Local2(p) => local(p, dofs),
        Friction::Local3(p) => local(p, dofs),
        Friction::Global2(p) => global(p),
        Friction::Global3(p) => global(p),
    };
    Ok(Facts {
        sizes: report::problem_json(file, problem),
        size_text: report::problem_text(problem),
        dofs,
        dimension,
        operator,
        pattern,
        multipliers,
        solution,
    })
}

/// The tolerance at which a stored solution is judged.
const JUDGED_AT: f64 = 1e-8;

type Structure = (usize, Option<usize>, Operator, Pattern, usize);

fn local<const D: usize>(p: &FrictionLocal<D>, dofs: Option<usize>) -> Structure {
    let asymmetry = p.W.asymmetry();
    let operator = Operator::Delassus { asymmetry };
    (D, dofs, operator, Pattern::of(&p.W), p.multipliers())
}

fn global<const D: usize>(p: &FrictionGlobal<D>) -> Structure {
    let mut bodies = Groups::new(p.dofs());
    for (i, j, x) in p.M.triplets() {
        if x != 0.0 {
            bodies.join(i, j);
        }
    }
    let operator = Operator::Mass {
        asymmetry: p.M.asymmetry(),
        entries: p.M.nnz(),
        entries_of_h: p.H.nnz(),
        components: bodies.sizes(),
        // Bilateral constraints may make up for a singular M in the dynamics, but M⁻¹ is needed all the same.
        singular: Inverse::new(&p.M, "M").err().or_else(|| {
            p.bilateral.as_ref()?;
            Dynamics::new(p).err()
        }),
    };
    // Bilateral constraints couple what they touch, in W as well.
    if let Some(bilateral) = &p.bilateral {
        let columns = (0..bilateral.G.ncols()).map(|j| bilateral.G.column(j).0);
        columns.for_each(|touched| bodies.join_all(touched));
    }
    let pattern = Pattern::condensed::<D>(&p.H, &mut bodies);
    (D, Some(p.dofs()), operator, pattern, p.multipliers())
}

impl Pattern {
    /// The structure of a stored W.
    fn of<const D: usize>(w: &Bsr<D>) -> Self {
        Self::gather(w.nrows(), |c, felt| {
            felt.extend(w.row(c).0.iter().map(|&j| j as usize));
        })
    }

    /// The structure that `W = Hᵀ M⁻¹ H` would have: contacts that share a component of M.
    fn condensed<const D: usize>(h: &Csc, bodies: &mut Groups) -> Self {
        let nc = h.ncols() / D;
        let mut touching = vec![vec![]; h.nrows()];
        let touched: Vec<Vec<usize>> = (0..nc)
            .map(|c| {
                let rows = (D * c..D * c + D).flat_map(|j| h.column(j).0);
                let mut all: Vec<_> = rows.map(|&i| bodies.root(i)).collect();
                all.sort_unstable();
                all.dedup();
                all.iter().for_each(|&body| touching[body].push(c));
                all
            })
            .collect();
        Self::gather(nc, |c, felt| {
            felt.extend(touched[c].iter().flat_map(|&body| &touching[body]));
        })
    }

    /// From the contacts that each contact feels, perhaps listed more than once.
    fn gather(contacts: usize, feels: impl Fn(usize, &mut Vec<usize>)) -> Self {
        let mut groups = Groups::new(contacts);
        let mut pattern = Self { blocks: 0, least: usize::MAX, most: 0, contacts, groups: 0 };
        let mut felt = vec![];
        let mut seen_by = vec![usize::MAX; contacts];
        for c in 0..contacts {
            felt.clear();
            feels(c, &mut felt);
            let mut blocks = 0;
            for &other in &felt {
                if seen_by[other] != c {
                    seen_by[other] = c;
                    blocks += 1;
                    groups.join(c, other);
                }
            }
            pattern.blocks += blocks;
            pattern.least = pattern.least.min(blocks);
            pattern.most = pattern.most.max(blocks);
        }
        pattern.groups = groups.sizes().iter().map(|&(_, n)| n).sum();
        pattern
    }

    fn mean(&self) -> f64 {
        self.blocks as f64 / self.contacts as f64
    }
}

/// Disjoint sets.
struct Groups {
    parent: Vec<usize>,
}

impl Groups {
    fn new(n: usize) -> Self {
        Self { parent: (0..n).collect() }
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.parent[i] != i {
            self.parent[i] = self.parent[self.parent[i]];
            i = self.parent[i];
        }
        i
    }

    fn join(&mut self, i: usize, j: usize) {
        let (i, j) = (self.root(i), self.root(j));
        self.parent[i.max(j)] = i.min(j);
    }

    fn join_all(&mut self, all: &[usize]) {
        all.windows(2).for_each(|two| self.join(two[0], two[1]));
    }

    /// `(size, how many)`, the most frequent first.
    fn sizes(&mut self) -> Vec<(usize, usize)> {
        let mut sizes = vec![0usize; self.parent.len()];
        for i in 0..sizes.len() {
            sizes[self.root(i)] += 1;
        }
        let mut times = std::collections::BTreeMap::new();
        for size in sizes.into_iter().filter(|&s| s > 0) {
            *times.entry(size).or_insert(0) += 1;
        }
        let mut all: Vec<_> = times.into_iter().collect();
        all.sort_by_key(|&(size, n)| (usize::MAX - n, size));
        all
    }
}

/// The least and the largest coefficient of friction, and how many are zero.
fn friction(mu: &[f64]) -> (f64, f64, usize) {
    let least = mu.iter().copied().fold(f64::INFINITY, f64::min);
    let most = mu.iter().copied().fold(0.0, f64::max);
    (least, most, mu.iter().filter(|&&m| m == 0.0).count())
}

impl Facts {
    fn density(&self) -> Option<f64> {
        let dofs = self.dofs.filter(|&n| n > 0)?;
        Some((self.dimension * self.pattern.contacts) as f64 / dofs as f64)
    }

    fn json(&self, content: &FclibFile) -> Value {
        let mut all = self.sizes.clone();
        let (least, most, frictionless) = friction(content.problem.mu());
        let pattern = &self.pattern;
        all.extend(report::fields(json!({
            "title": content.info.title,
            "description": content.info.description,
            "form": match self.operator { Operator::Delassus { .. } => "local", Operator::Mass { .. } => "global" },
            "dimension": self.dimension,
            "dofs": self.dofs,
            "contact_density": self.density(),
            "mu": {"min": least, "max": most, "frictionless": frictionless},
            "bilateral_rows": self.multipliers,
        })));
        if let Operator::Mass { entries, entries_of_h, components, singular, .. } = &self.operator {
            let components = components.iter().map(|(size, n)| json!({"size": size, "count": n}));
            all.insert("entries".into(), json!({"M": entries, "H": entries_of_h}));
            all.insert("components".into(), components.collect());
            all.insert("singular".into(), json!(singular.as_ref().map(|e| e.to_string())));
        }
        let (Operator::Delassus { asymmetry } | Operator::Mass { asymmetry, .. }) = self.operator;
        all.extend(report::fields(json!({
            "asymmetry": asymmetry,
            "W": {
                "blocks": pattern.blocks,
                "blocks_per_row": {"min": pattern.least, "mean": pattern.mean(), "max": pattern.most},
                "connected_groups": pattern.groups,
            },
            "guesses": content.guesses.len(),
            "solution": self.solution.as_ref().map(|v| report::verdict_json(v, JUDGED_AT, v.worst.len())),
        })));
        Value::Object(all)
    }

    fn text(&self, file: &Path, content: &FclibFile) -> String {
        let mut text = format!("{}: {}\n", file.display(), self.size_text);
        let info = &content.info;
        for (label, said) in [("title", &info.title), ("about", &info.description)] {
            if let Some(said) = said.as_deref().map(str::trim).filter(|s| !s.is_empty()) {
                row(&mut text, label, said.replace('\n', "\n             "));
            }
        }
        let dofs = match (self.dofs, self.density()) {
            (Some(n), Some(c)) => {
                let much = if c > 1.0 { " (hyperstatic)" } else { "" };
                format!("{n} degrees of freedom, contact density c = {c:.3}{much}")
            }
            _ => "degrees of freedom unknown, so contact density unknown".into(),
        };
        row(&mut text, "density", dofs);
        let (least, most, frictionless) = friction(content.problem.mu());
        let mu = if least == most {
            format!("mu = {least}")
        } else {
            format!(
                "mu from {least} to {most}, {} without friction",
                count(frictionless, "contact")
            )
        };
        row(&mut text, "friction", mu);
        let pattern = &self.pattern;
        let blocks = format!(
            "{} of {d} x {d}, by row {} to {}, {:.1} on average; {}",
            count(pattern.blocks, "block"),
            pattern.least,
            pattern.most,
            pattern.mean(),
            count(pattern.groups, "connected group"),
            d = self.dimension,
        );
        match &self.operator {
            Operator::Delassus { asymmetry } => {
                row(&mut text, "W", format!("{blocks}, {}", symmetry(*asymmetry)));
            }
            Operator::Mass { asymmetry, entries, entries_of_h, components, singular } => {
                let m = format!("{entries} entries, {}", symmetry(*asymmetry));
                row(&mut text, "M", format!("{m}, {}", sizes(components)));
                if let Some(e) = singular {
                    row(&mut text, "", format!("M is singular: {e}"));
                }
                row(&mut text, "H", format!("{entries_of_h} entries"));
                row(&mut text, "W", format!("if condensed: {blocks}"));
            }
        }
        if self.multipliers > 0 {
            row(&mut text, "bilateral", count(self.multipliers, "row"));
        }
        if !content.guesses.is_empty() {
            row(&mut text, "guesses", content.guesses.len());
        }
        match &self.solution {
            None if content.solution.is_some() => {
                row(&mut text, "solution", "stored, but M is singular: it cannot be judged");
            }
            None => row(&mut text, "solution", "none stored"),
            Some(verdict) => {
                let passes = if verdict.solved { "passes" } else { "does not pass" };
                row(&mut text, "solution", format!("stored, {passes} at {JUDGED_AT:e}"));
                report::verdict_text(&mut text, verdict, JUDGED_AT, 0);
            }
        }
        text
    }
}

fn symmetry(asymmetry: f64) -> String {
    match asymmetry {
        0.0 => "symmetric".into(),
        a => format!("asymmetry {}", number(a)),
    }
}

/// `diagonal`, or `61 components of size 6` and so on for the most frequent sizes.
fn sizes(components: &[(usize, usize)]) -> String {
    if matches!(components, [(1, _)]) {
        return "diagonal".into();
    }
    const SHOWN: usize = 4;
    let first = components.iter().take(SHOWN);
    let mut texts: Vec<_> =
        first.map(|&(size, n)| format!("{} of size {size}", count(n, "component"))).collect();
    let rest: usize = components.iter().skip(SHOWN).map(|&(_, n)| n).sum();
    if rest > 0 {
        texts.push(format!("{rest} of other sizes"));
    }
    texts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_and_their_sizes() {
        let mut groups = Groups::new(7);
        groups.join(0, 3);
        groups.join(3, 6);
        groups.join(4, 5);
        assert_eq!(groups.root(6), 0);
        assert_eq!(groups.sizes(), [(1, 2), (2, 1), (3, 1)]);
        groups.join_all(&[0, 1, 2, 4]);
        assert_eq!(groups.sizes(), [(7, 1)]);
    }

    #[test]
    fn the_pattern_of_w_is_that_of_the_condensed_problem() {
        let scene = nonsmooth_dynamics::SceneEntry::find("wall")
            .and_then(|wall| wall.make(&Default::default()))
            .unwrap();
        let (problem, condensed) = (scene.problem().unwrap(), scene.condensed().unwrap());
        let mut bodies = Groups::new(problem.dofs());
        problem.M.triplets().for_each(|(i, j, _)| bodies.join(i, j));
        let expected = Pattern::of(&condensed.W);
        let pattern = Pattern::condensed::<3>(&problem.H, &mut bodies);
        assert_eq!(pattern.groups, expected.groups);
        assert_eq!(pattern.blocks, expected.blocks);
        assert_eq!((pattern.least, pattern.most), (expected.least, expected.most));
    }
}
