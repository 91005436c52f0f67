//! What makes a problem hard, in sentences: each with its numbers, what follows from them, and the solvers that suit,
//! named by the registry.

use std::borrow::Cow;
use std::time::Instant;

use nonsmooth_analysis::{Spectrum, Traits, rank};
use nonsmooth_linalg::{Bsr, Csc, Delassus, Inverse, norm, small};
use nonsmooth_problem::check::{Existence, Impulses, Judged};
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal, OfAny, with_friction};
use serde::Serialize;

use crate::contact::existence;
use crate::contact::form::{Access, Linear, Rows};
use crate::core::guard;
use crate::core::register::{Registered, Solves};
use crate::registry;
use crate::{Limit, Limits, Solve, Status};

/// One thing worth knowing of a problem.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What it is about, in a word.
    pub about: &'static str,
    /// The numbers.
    pub says: String,
    /// What follows for solvers; empty where nothing does.
    pub means: String,
    /// Whether it makes the problem hard.
    pub hard: bool,
    /// Solvers that suit, by the registry.
    pub suits: Vec<&'static str>,
}

/// What was found, and what to try.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// One entry a topic.
    pub findings: Vec<Finding>,
    /// Solvers to try: those that solved the problem on trial, the fastest first.
    pub suits: Vec<&'static str>,
    /// What came of every solver that the findings suggest.
    pub trials: Vec<Trial>,
}

/// A short solve of the problem itself, so that nothing is advised that does not help.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trial {
    /// The solver.
    pub solver: &'static str,
    /// How it ended.
    pub status: &'static str,
    /// The relative residual that it reached, by the judge.
    pub relative: f64,
    /// Iterations.
    pub iterations: usize,
    /// Wall clock.
    pub seconds: f64,
}

/// How much a diagnosis may cost.
#[derive(Debug, Clone)]
pub struct Effort {
    /// The most rows for which the singular values of W are computed.
    pub spectrum_limit: usize,
    /// Limits of it all: half of the time for singular values, most of the rest for the question of existence, what is then left for trials of solvers.
    /// Their tolerance is that of the trials.
    pub limits: Limits,
}

/// Explains a problem. `dofs` are the degrees of freedom that a local problem was condensed from, if known.
///
/// Errors: the limit that came before there was anything to say.
pub fn diagnose(
    problem: &Friction,
    dofs: Option<usize>,
    effort: &Effort,
) -> Result<Diagnosis, Limit> {
    let copy = (problem.clone(), effort.spectrum_limit);
    guard::run(
        &effort.limits,
        || {},
        move |limits| {
            let (problem, rows) = copy;
            let begun = Instant::now();
            let scope = limits.budget(begun).enter();
            let traits = Traits::of(&problem, dofs);
            let spectrum = spectrum(&problem, rows, &part(limits, begun, 0.5)).ok();
            let existence = existence::of(&problem, &part(limits, begun, 0.8));
            let found = with_friction!(&problem, p => {
                let mut found = Patient { problem: p, traits, spectrum, existence }.diagnose();
                found.put_to_the_test(p, &part(limits, begun, 0.8));
                found
            });
            match limits.reached(begun) {
                Some(limit) if scope.raised() => Err(limit),
                _ => Ok(found),
            }
        },
    )
    .and_then(|found| found)
}

/// A trial is no longer than this, in seconds.
const TRIAL: f64 = 2.0;

impl Diagnosis {
    /// Tries what the findings suggest, each for a part of the time, and keeps what solves the problem.
    fn put_to_the_test<P: Registered + Judged<Status: 'static> + OfAny>(
        &mut self,
        problem: &P,
        limits: &Limits,
    ) {
        let each = limits.time_limit.map_or(TRIAL, |t| t / self.suits.len().max(1) as f64);
        let limits = Limits { time_limit: Some(each.min(TRIAL)), ..limits.clone() };
        for solver in std::mem::take(&mut self.suits) {
            // One that does not apply is no advice.
            let Ok(answer) = Solve::new().solver(solver).limits(limits.clone()).run(problem) else {
                continue;
            };
            self.trials.push(Trial {
                solver,
                status: answer.status.name(),
                relative: answer.verdict.measure.relative,
                iterations: answer.iterations,
                seconds: answer.seconds,
            });
        }
        self.trials.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let solved = self.trials.iter().filter(|t| t.status == Status::Solved.name());
        self.suits = solved.map(|t| t.solver).collect();
    }
}

/// Trials of solvers in place of one that refused the problem take no longer than this together, in seconds, and name so many at most.
const INSTEAD: f64 = 1.0;
const MOST_INSTEAD: usize = 3;

/// Solvers that solve the problem where `refused` does not apply: the same method behind a prefix, others of its family, `auto`; each was tried, for a quarter
/// of a second at most.
pub fn instead<P: Registered + Judged<Status: 'static> + OfAny>(
    problem: &P,
    refused: &str,
    limits: &Limits,
) -> Vec<String> {
    let begun = Instant::now();
    let method = refused.rsplit('/').next().unwrap_or(refused);
    let abouts = registry::abouts::<P>();
    let family = abouts.iter().find(|a| a.name == method).map(|a| a.family);
    let behind = registry::composed_names::<P>();
    let behind = behind.into_iter().filter(|n| n.rsplit('/').next() == Some(method));
    let kin = abouts.iter().filter(|a| Some(a.family) == family && a.solves == Solves::Law);
    let candidates = behind
        .chain(kin.map(|a| a.name.to_owned()))
        .chain([registry::DEFAULT.to_owned()])
        .filter(|name| name != refused);
    let total = limits.time_limit.unwrap_or(INSTEAD).min(INSTEAD);
    let mut solving: Vec<String> = vec![];
    for name in candidates {
        let left = total - begun.elapsed().as_secs_f64();
        if left <= 0.0 || solving.len() >= MOST_INSTEAD {
            break;
        }
        let limits = Limits { time_limit: Some(left.min(0.25 * INSTEAD)), ..limits.clone() };
        let answer = Solve::new().solver(&name).limits(limits).run(problem);
        if answer.is_ok_and(|a| a.is_solved()) && !solving.contains(&name) {
            solving.push(name);
        }
    }
    solving
}

/// A share of what is left of the time.
fn part(limits: &Limits, begun: Instant, share: f64) -> Limits {
    let spent = begun.elapsed().as_secs_f64();
    let time_limit = limits.time_limit.map(|t| share * (t - spent).max(0.0));
    Limits { time_limit, ..limits.clone() }
}

/// The singular values of W within the limits of time and memory, up to so many rows.
///
/// Errors: why there are none, in words.
pub fn spectrum(problem: &Friction, rows: usize, limits: &Limits) -> Result<Spectrum, String> {
    let copy = problem.clone();
    let found = guard::run(
        limits,
        || {},
        move |limits| {
            let begun = Instant::now();
            let scope = limits.budget(begun).enter();
            let found = Spectrum::of(&copy, rows);
            match limits.reached(begun) {
                Some(limit) if scope.raised() => Err(limit),
                _ => Ok(found),
            }
        },
    );
    match found.and_then(|found| found) {
        Ok(found) => found.map_err(|e| e.to_string()),
        Err(Limit::Cancelled) => Err("it was cancelled".into()),
        Err(_) => Err("the time limit came first".into()),
    }
}

/// What a diagnosis needs of a kind of problem.
trait Seen<const D: usize>: Linear<D> + Rows<D> {
    /// W, where it is stored or cheap to form.
    fn delassus(&self, traits: &Traits) -> Option<Cow<'_, Bsr<D>>>;

    /// The bilateral constraints as columns, redundant where they depend on each other. Rows with bounds are none.
    fn constraints(&self) -> Option<Csc>;
}

/// W is formed of components of M up to this size, with up to so many blocks.
const SMALL_BODY: usize = 48;
const BLOCKS: usize = 300_000;

impl<const D: usize> Seen<D> for FrictionLocal<D> {
    fn delassus(&self, _: &Traits) -> Option<Cow<'_, Bsr<D>>> {
        Some(Cow::Borrowed(&self.W))
    }

    fn constraints(&self) -> Option<Csc> {
        let b = self.rows.as_ref()?;
        let (m, free) = (self.q.len(), b.bounds.free(b.s.len()));
        let of_rows = b.R.columns(&free);
        let r = of_rows.triplets().map(|(i, j, x)| (m + i, j, x));
        let v = b.V.columns(&free);
        Csc::from_triplets(m + b.s.len(), free.len(), v.triplets().chain(r)).ok()
    }
}

impl<const D: usize> Seen<D> for FrictionGlobal<D> {
    fn delassus(&self, traits: &Traits) -> Option<Cow<'_, Bsr<D>>> {
        let components = &traits.mass.as_ref()?.components;
        let small = components.iter().all(|c| c.size <= SMALL_BODY);
        if !small || traits.W.blocks > BLOCKS || self.rows.is_some() {
            return None;
        }
        let inverse = Inverse::new(&self.M, "M").ok()?;
        Some(Cow::Owned(Delassus::<D>::condense(&self.H, &inverse)))
    }

    fn constraints(&self) -> Option<Csc> {
        let b = self.rows.as_ref()?;
        Some(b.G.columns(&b.bounds.free(b.b.len())))
    }
}

struct Patient<'a, P, const D: usize> {
    problem: &'a P,
    traits: Traits,
    spectrum: Option<Spectrum>,
    existence: Existence,
}

/// The families that suit, the best first; those that do not exist are passed over.
const RANK_DEFICIENT: &[&str] = &["auto", "proximal", "interior"];
const REGULAR: &[&str] = &["auto", "newton", "splitting"];
const ANY: &[&str] = &["auto", "splitting"];

/// Solvers of the families, the default where there is none.
fn of_families<P: Registered>(families: &[&str]) -> Vec<&'static str> {
    let abouts = registry::abouts::<P>();
    let of = |family: &&str| abouts.iter().find(|a| a.family == *family).map(|a| a.name);
    let mut names: Vec<_> = families.iter().filter_map(of).collect();
    if names.is_empty() {
        names.push(registry::DEFAULT);
    }
    names
}

/// Above this ratio of effective masses sweeps are slow.
const MASS_RATIO: f64 = 1e3;
/// Above this asymmetry W is not symmetric by rounding.
const SKEW: f64 = 1e-8;
/// A condition number above which the last digits are hard to get.
const CONDITION: f64 = 1e6;
/// The cosine above which two normals are one, in the metric of W.
const PARALLEL: f64 = 1.0 - 1e-6;
/// The most entries of a dense matrix of constraints.
const DENSE: usize = 2_000_000;

impl<P: Seen<D> + Registered, const D: usize> Patient<'_, P, D> {
    fn diagnose(self) -> Diagnosis {
        let mut findings = vec![self.size()];
        findings.extend(self.hyperstaticity());
        findings.extend(self.conditioning());
        findings.extend(self.asymmetry());
        let bounded = self.problem.bounds().map_or(0, |bounds| bounds.bounded().count());
        if bounded > 0 {
            let says = format!("{bounded} scalar rows with bounds");
            let mean = "Limits or motors: sweeps visit them; methods that know no bounds refuse the problem.";
            findings.push(hard("rows", says, mean, vec!["nsgs", "auto"]));
        }
        match self.problem.state(if bounded > 0 { Access::Rows } else { Access::Products }) {
            Ok(state) => {
                findings.push(self.mass_ratio(&state));
                findings.push(self.motion(state));
            }
            Err(e) => findings.push(hard(
                "dynamics",
                e.to_string(),
                "Nothing can be solved: q and W ask for the inverse of M.",
                vec![],
            )),
        }
        findings.push(self.friction());
        findings.extend(self.parallel());
        findings.extend(self.groups());
        findings.extend(self.constraints());
        findings.push(self.existence());
        let none = matches!(self.existence, Existence::NoSolution { .. });
        let mut suits: Vec<&'static str> = vec![];
        // The hard findings speak first.
        let (hard, easy): (Vec<&Finding>, Vec<_>) = findings.iter().partition(|f| f.hard);
        for name in hard.into_iter().chain(easy).flat_map(|f| &f.suits) {
            if !suits.contains(name) && !none {
                suits.push(name);
            }
        }
        Diagnosis { findings, suits, trials: vec![] }
    }

    fn size(&self) -> Finding {
        let (nc, m) = (self.traits.contacts, self.traits.impulses());
        let says = format!("{} contacts in {D}D, {m} components of impulses", nc);
        match nc {
            0..=100 => easy("size", says, "Small: every solver's step is cheap."),
            101..=2000 => {
                easy("size", says, "Of middle size: factorisations take milliseconds to a second.")
            }
            _ => Finding {
                suits: of_families::<P>(ANY),
                ..easy(
                    "size",
                    says,
                    "Large: sweeps are cheap, factorisations are what a Newton or interior-point step costs.",
                )
            },
        }
    }

    fn hyperstaticity(&self) -> Option<Finding> {
        let m = self.traits.impulses();
        if let Some(s) = &self.spectrum {
            let ratio = s.rank_ratio()?;
            let says =
                format!("W has rank {} of {m} (rank ratio {ratio:.2}){}", s.rank, self.density());
            return Some(if s.rank < m {
                let slow = "The impulses are not unique. Gauss-Seidel and projections get slow below about 1e-4, and Newton's matrix is singular unless it is made regular.";
                hard("rank", says, slow, of_families::<P>(RANK_DEFICIENT))
            } else {
                Finding {
                    suits: of_families::<P>(REGULAR),
                    ..easy(
                        "rank",
                        says,
                        "Not hyperstatic: velocities determine the impulses, so Newton's method converges fast near the solution.",
                    )
                }
            });
        }
        let c = self.traits.density()?;
        let says = format!(
            "contact density c = {c:.2}; W has rank at most {} of {m}",
            self.traits.dofs?.min(m)
        );
        Some(if c > 1.0 {
            let slow = "Hyperstatic: the impulses are not unique, and Gauss-Seidel gets slow below about 1e-4.";
            hard("rank", says, slow, of_families::<P>(RANK_DEFICIENT))
        } else {
            easy("rank", says, "")
        })
    }

    fn density(&self) -> String {
        self.traits.density().map_or(String::new(), |c| format!(", contact density c = {c:.2}"))
    }

    fn conditioning(&self) -> Option<Finding> {
        let s = self.spectrum.as_ref()?;
        let condition = s.condition()?;
        let says = format!(
            "condition number of W on its range {condition:.1e} (singular values {:.1e} to {:.1e})",
            s.least, s.largest
        );
        Some(if condition > CONDITION {
            let lost = format!(
                "Up to {:.0} of 16 digits of r are lost to rounding (u keeps more); first-order methods need about {:.0e} steps for each digit.",
                condition.log10(),
                condition.sqrt()
            );
            hard("condition", says, &lost, of_families::<P>(RANK_DEFICIENT))
        } else {
            easy("condition", says, "")
        })
    }

    fn asymmetry(&self) -> Option<Finding> {
        let a = self.traits.asymmetry;
        (a > 0.0).then(|| {
            let of = if self.traits.mass.is_some() { "M" } else { "W" };
            let says = format!("asymmetry of {of} {a:.1e}");
            if a <= SKEW {
                easy("asymmetry", says, "Rounding: W counts as symmetric.")
            } else {
                let mean = "Methods that minimise an energy (optimisation, ADMM) see the symmetric part only and need an outer loop; sweeps, projections and Newton do not mind.";
                hard("asymmetry", says, mean, of_families::<P>(&["auto", "newton", "splitting"]))
            }
        })
    }

    fn mass_ratio(&self, state: &P::State) -> Finding {
        let w: Vec<f64> = (0..self.traits.contacts)
            .map(|c| small::mean_diagonal(&self.problem.diagonal_block(state, c)))
            .collect();
        let dead = w.iter().filter(|&&w| w <= 0.0).count();
        if dead > 0 {
            let says = format!("{dead} contacts that no impulse can move (w_c <= 0)");
            return hard("mass ratio", says, "Their law holds by q alone or not at all.", vec![]);
        }
        let least = w.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = w.iter().copied().fold(0.0, f64::max);
        let ratio = largest / least;
        let says = format!(
            "effective masses of contacts spread by {ratio:.1e} (w_c from {least:.1e} to {largest:.1e} 1/kg)"
        );
        if ratio > MASS_RATIO {
            let slow = "Light bodies pass the load of heavy ones on, which takes a sweep for each link and power of the ratio: Gauss-Seidel is slow.";
            hard("mass ratio", says, slow, of_families::<P>(&["auto", "interior", "newton"]))
        } else {
            easy("mass ratio", says, "")
        }
    }

    fn motion(&self, mut state: P::State) -> Finding {
        let zero = vec![0.0; self.traits.impulses()];
        let mut q = zero.clone();
        self.problem.velocities(&mut state, &zero, &mut q);
        let normal: Vec<f64> = q.iter().copied().step_by(D).collect();
        let approaching = normal.iter().filter(|&&q| q < 0.0).count();
        let fastest = normal.iter().copied().fold(0.0, f64::min);
        let says = format!(
            "{approaching} of {} contacts approach without impulses, the fastest at {:.1e} m/s (root mean square of q {:.1e} m/s)",
            normal.len(),
            0.0_f64.max(-fastest),
            norm(&q) / (normal.len() as f64).sqrt()
        );
        if approaching == 0 {
            return easy("motion", says, "r = 0 is the solution where no contact approaches.");
        }
        // A load at rest moves all contacts alike; an impact a few of them, fast.
        let mean = -normal.iter().map(|q| q.min(0.0)).sum::<f64>() / approaching as f64;
        if -fastest > 20.0 * mean {
            let says_more = "An impact: a few contacts approach much faster than the others, and their impulses must travel through all contacts.";
            hard("motion", says, says_more, of_families::<P>(ANY))
        } else {
            easy(
                "motion",
                says,
                "Contacts approach about alike, as under weight or in a common fall.",
            )
        }
    }

    fn friction(&self) -> Finding {
        let mu = self.traits.mu;
        let says = format!(
            "mu from {} to {}, {} contacts without friction",
            mu.min, mu.max, mu.frictionless
        );
        if mu.max == 0.0 {
            return easy(
                "friction",
                says,
                "A convex problem (a linear complementarity problem): it has a solution exactly if some motion has u_N >= 0, and any local solver does.",
            );
        }
        if mu.max > 1.0 {
            let jam = "Above 1 the cone is wider than 45 degrees: jamming is likely, solutions may be many or none, and the coupling of u_N and u_T is strong.";
            return hard("friction", says, jam, of_families::<P>(ANY));
        }
        easy("friction", says, "")
    }

    fn parallel(&self) -> Option<Finding> {
        let w = self.problem.delassus(&self.traits)?;
        let normal = |c: usize, d: usize| w.get(c, d).map_or(0.0, |b| b[0][0]);
        let diagonal: Vec<f64> = (0..w.nrows()).map(|c| normal(c, c)).collect();
        let has_twin = |c: &usize| {
            let (columns, blocks) = w.row(*c);
            columns.iter().zip(blocks).any(|(&d, b)| {
                let d = d as usize;
                let size = (diagonal[*c] * diagonal[d]).sqrt();
                d != *c && size > 0.0 && b[0][0] >= PARALLEL * size
            })
        };
        let twins = (0..w.nrows()).filter(has_twin).count();
        (twins > 0).then(|| {
            let says = format!("{twins} contacts have a twin: a contact whose normal impulse has the same effect");
            let mean = "How they share the load is undetermined; the velocities are not touched by it. Thinning contact points loses nothing.";
            hard("duplicates", says, mean, of_families::<P>(RANK_DEFICIENT))
        })
    }

    fn groups(&self) -> Option<Finding> {
        let groups = self.traits.W.groups;
        (groups > 1).then(|| {
            let says = format!("{groups} groups of contacts that do not feel each other");
            easy(
                "groups",
                says,
                "They are independent problems: the slowest of them decides the iterations of all.",
            )
        })
    }

    fn constraints(&self) -> Option<Finding> {
        let columns = self.problem.constraints()?;
        let p = columns.ncols();
        if p == 0 {
            return None;
        }
        let Some(rank) = rank(&columns, DENSE) else {
            return Some(easy("bilateral", format!("{p} bilateral rows"), ""));
        };
        let says = format!("{p} bilateral rows of rank {rank}");
        Some(if rank < p {
            hard(
                "bilateral",
                says,
                "Some are redundant: multipliers are not unique; all solvers here take that.",
                vec![],
            )
        } else {
            easy("bilateral", says, "")
        })
    }

    /// Where bodies are forced into each other.
    fn squeezed(&self, impulses: Option<&Impulses>) -> String {
        let Some(impulses) = impulses else {
            return "Look at the matrix and the given velocities: no choice of open, sticking and sliding contacts satisfies them.".into();
        };
        let pressed = impulses.pressed(self.traits.contacts);
        let shown: Vec<_> = pressed.iter().take(6).map(usize::to_string).collect();
        let more = if pressed.len() > shown.len() { ", ..." } else { "" };
        format!(
            "Look at the given velocities w at contacts {}{more}: they press rigid bodies into each other.",
            shown.join(", ")
        )
    }

    fn existence(&self) -> Finding {
        let says = self.existence.to_string();
        match &self.existence {
            Existence::Proved { .. } | Existence::Solved { .. } => {
                easy("existence", says, "A solver that fails has failed; the problem is sound.")
            }
            Existence::NearlyProved { .. } => easy(
                "existence",
                says,
                "A solver that fails has most likely failed; the problem is sound but for rounding.",
            ),
            Existence::NearlyNoSolution { certificate, .. } => hard(
                "existence",
                says,
                &self.squeezed(certificate.impulses()),
                of_families::<P>(ANY),
            ),
            Existence::NoSolution { proof } => {
                let mean = self.squeezed(proof.certificate().impulses());
                hard("existence", says, &format!("No solver can succeed. {mean}"), vec![])
            }
            Existence::Weak { .. } | Existence::CriterionRefuted { .. } => hard(
                "existence",
                says,
                "Bodies can jam. If no solver gets below a residual that does not depend on the solver, there may be no solution; less friction makes one more likely.",
                of_families::<P>(ANY),
            ),
            Existence::Unknown { .. } => easy("existence", says, ""),
        }
    }
}

fn easy(about: &'static str, says: String, means: &str) -> Finding {
    Finding { about, says, means: means.into(), hard: false, suits: vec![] }
}

fn hard(about: &'static str, says: String, means: &str, suits: Vec<&'static str>) -> Finding {
    Finding { about, says, means: means.into(), hard: true, suits }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_problem::planted::Planted;

    fn of(problem: Friction) -> Diagnosis {
        diagnose(&problem, None, &Effort { spectrum_limit: 500, limits: Limits::default() })
            .unwrap()
    }

    fn says<'a>(diagnosis: &'a Diagnosis, about: &str) -> Option<&'a Finding> {
        diagnosis.findings.iter().find(|f| f.about == about)
    }

    #[test]
    fn a_regular_problem_is_sound_and_a_hyperstatic_one_hard() {
        let regular = Planted { contacts: 8, dofs: 48, ..Planted::default() };
        let d = of(Friction::Local3(regular.local().0));
        assert!(!says(&d, "rank").unwrap().hard, "{d:?}");
        assert!(says(&d, "existence").unwrap().says.starts_with("proved"), "{d:?}");
        assert!(!d.suits.is_empty());
        let hyperstatic = Planted { contacts: 20, dofs: 30, ..Planted::default() };
        let d = of(Friction::Global3(hyperstatic.global().0));
        let finding = says(&d, "rank").unwrap();
        assert!(finding.hard && finding.says.contains("rank 30 of 60"), "{finding:?}");
        assert!(finding.says.contains("c = 2.00"), "{finding:?}");
    }

    #[test]
    fn what_is_planted_is_found() {
        let case =
            Planted { contacts: 6, dofs: 36, mu: (0.0, 0.0), skew: 0.3, ..Planted::default() };
        let (mut p, _) = case.global::<3>();
        let d = of(Friction::Global3(p.clone()));
        assert!(says(&d, "asymmetry").unwrap().hard && says(&d, "duplicates").is_none());
        assert!(says(&d, "friction").unwrap().means.contains("convex"));
        // The second contact becomes a copy of the first, and is on a much lighter place.
        let h = p.H.triplets().filter(|e| !(3..6).contains(&e.1)).collect::<Vec<_>>();
        let copies = h.iter().filter(|e| e.1 < 3).map(|&(i, j, x)| (i, j + 3, 1e3 * x));
        p.H = Csc::from_triplets(36, 18, h.iter().copied().chain(copies)).unwrap();
        p.mu[2] = 1.5;
        let d = of(Friction::Global3(p));
        assert!(says(&d, "duplicates").unwrap().says.starts_with("2 contacts"), "{d:?}");
        assert!(says(&d, "mass ratio").unwrap().hard && says(&d, "friction").unwrap().hard);
    }

    #[test]
    fn redundant_constraints_are_counted() {
        let (mut p, _) = Planted { bilateral: 3, ..Planted::default() }.global::<2>();
        let b = p.rows.as_mut().unwrap();
        let twice = b.G.triplets().flat_map(|(i, j, x)| [(i, j, x), (i, j + 3, -2.0 * x)]);
        b.G = Csc::from_triplets(b.G.nrows(), 6, twice).unwrap();
        let more: Vec<f64> = b.b.iter().map(|b| -2.0 * b).collect();
        b.b.extend(more);
        let d = of(Friction::Global2(p));
        assert!(
            says(&d, "bilateral").unwrap().says.contains("6 bilateral rows of rank 3"),
            "{d:?}"
        );
    }

    #[test]
    fn every_family_that_is_asked_for_or_its_stand_in_is_registered() {
        let known = registry::solver_names::<FrictionLocal<3>>();
        for families in [RANK_DEFICIENT, REGULAR, ANY, &["no such family"]] {
            for name in of_families::<FrictionLocal<3>>(families) {
                assert!(known.iter().any(|k| k == name), "{name}");
            }
        }
    }
}
