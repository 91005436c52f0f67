//! Of a problem of frictional contact.

use std::borrow::Cow;
use std::time::Instant;

use nonsmooth_analysis::{Spectrum, Traits, rank};
use nonsmooth_linalg::{Bsr, Csc, Delassus, Inverse, norm};
use nonsmooth_problem::check::{Existence, Impulses};
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal, with_friction};

use super::{Finding, easy, hard};
use crate::contact::form::{Access, Linear, Rows};
use crate::contact::law::DiskLaw;
use crate::core::guard;
use crate::core::register::Registered;
use crate::registry;
use crate::{Limit, Limits, existence};

/// What there is to say; singular values within `half`, the question of existence within `most` of the time.
pub(super) fn findings(
    problem: &Friction,
    dofs: Option<usize>,
    rows: usize,
    half: impl Fn() -> Limits,
    most: impl Fn() -> Limits,
) -> (Vec<Finding>, Existence) {
    let traits = Traits::of(problem, dofs);
    let spectrum = spectrum(problem, rows, &half()).ok();
    let existence = existence::of_contacts(problem, &most());
    with_friction!(problem, p => {
        let patient = Patient { problem: p, traits, spectrum, existence };
        (patient.findings(), patient.existence)
    })
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

impl<const D: usize, L: DiskLaw<D>> Seen<D> for FrictionLocal<D, L> {
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

impl<const D: usize, L: DiskLaw<D>> Seen<D> for FrictionGlobal<D, L> {
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
    fn findings(&self) -> Vec<Finding> {
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
        findings
    }

    fn size(&self) -> Finding {
        let (nc, m) = (self.traits.contacts, self.traits.impulses());
        let space = if D == 5 { "3D with rolling friction".into() } else { format!("{D}D") };
        let says = format!("{nc} contacts in {space}, {m} components of impulses");
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
            .map(|c| {
                // Of velocities: of rolling the unit is another.
                let w = self.problem.diagonal_block(state, c);
                (0..D.min(3)).map(|k| w[k][k]).sum::<f64>() / D.min(3) as f64
            })
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
            Existence::Proved { .. } | Existence::Solved { .. } | Existence::EveryQ { .. } => {
                easy("existence", says, "A solver that fails has failed; the problem is sound.")
            }
            Existence::NearlyProved { .. } | Existence::NearlySolved { .. } => easy(
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
