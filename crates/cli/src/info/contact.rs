//! What `nonsmooth info` says of frictional contact problems.

use nonsmooth_analysis::{Components, Mass, MuRange, Spectrum, Traits};
use nonsmooth_linalg::Inverse;
use nonsmooth_problem::check::{Existence, Law};
use nonsmooth_problem::{Dynamics, Friction, FrictionGlobal, ProblemError};
use nonsmooth_solve::diagnose::spectrum;
use nonsmooth_solve::{Limits, existence};
use serde_json::{Value, json};

use super::{Args, symmetry};
use crate::exists;
use crate::report::{self, Object, count, number, row};

/// What there is to say of a problem.
pub(super) struct Facts {
    traits: Traits,
    /// Why a global problem's dynamics cannot be inverted, so that there is nothing to solve.
    singular: Option<ProblemError>,
    /// If asked for, or cheap.
    existence: Option<Existence>,
    /// If asked for.
    spectrum: Option<Result<Spectrum, String>>,
}

/// The time for the existence of a solution.
const EXISTENCE_SECONDS: f64 = 60.0;
/// A short search for existence takes up to about a second with so many contacts, unless a body has many unknowns.
const FEW_CONTACTS: usize = 2000;
/// Unknowns of a rigid body or a small elastic one.
const SMALL_BODY: usize = 48;

fn singular<const D: usize, L: Law<D>>(p: &FrictionGlobal<D, L>) -> Option<ProblemError> {
    // Bilateral constraints may make up for a singular M in the dynamics, but M⁻¹ is needed all the same.
    Inverse::new(&p.M, "M").err().map(ProblemError::from).or_else(|| {
        p.rows.as_ref()?;
        Dynamics::new(p).err()
    })
}

impl Facts {
    /// Everything about a problem but its spectrum and the existence of a solution.
    pub(super) fn of(problem: &Friction, dofs: Option<usize>) -> Self {
        let singular = match problem {
            Friction::Local2(_) | Friction::Local3(_) | Friction::RollingLocal(_) => None,
            Friction::Global2(p) => singular(p),
            Friction::Global3(p) => singular(p),
            Friction::RollingGlobal(p) => singular(p),
        };
        Self { traits: Traits::of(problem, dofs), singular, existence: None, spectrum: None }
    }

    /// Spectrum and existence within the limits that are left, as far as they are asked for or cheap.
    pub(super) fn search(&mut self, problem: &Friction, args: &Args, left: impl Fn() -> Limits) {
        if args.spectrum {
            self.spectrum = Some(spectrum(problem, args.spectrum_limit, &left()));
        }
        if self.singular.is_some() {
            return;
        }
        self.existence = if args.existence {
            let left = left();
            let time_limit = Some(left.time_limit.unwrap_or(EXISTENCE_SECONDS));
            Some(existence::of_contacts(problem, &Limits { time_limit, ..left }))
        } else {
            self.is_small().then(|| existence::glance(problem))
        };
    }

    /// A short search for existence costs next to nothing.
    fn is_small(&self) -> bool {
        let bodies = self.traits.mass.iter().flat_map(|m| &m.components);
        self.traits.contacts <= FEW_CONTACTS && bodies.map(|c| c.size).all(|s| s <= SMALL_BODY)
    }

    /// As JSON.
    pub(super) fn json(&self) -> Object {
        let traits = &self.traits;
        let mut all = report::fields(json!({
            "form": if traits.mass.is_some() { "global" } else { "local" },
            "dimension": traits.kind.dimension(),
            "dofs": traits.dofs,
            "contact_density": traits.density(),
            "mu": traits.mu,
            "bilateral_rows": traits.bilateral_rows,
        }));
        if let Some(mu_r) = traits.mu_r {
            all.insert("mu_r".into(), json!(mu_r));
        }
        if let Some(Mass { entries, components }) = &traits.mass {
            let singular = self.singular.as_ref().map(ProblemError::to_string);
            all.extend(report::fields(json!({
                "entries": entries,
                "components": components,
                "singular": singular,
            })));
        }
        let pattern = &traits.W;
        all.extend(report::fields(json!({
            "asymmetry": traits.asymmetry,
            "W": {
                "blocks": pattern.blocks,
                "blocks_per_row": {"min": pattern.row_min, "mean": pattern.row_mean(), "max": pattern.row_max},
                "connected_groups": pattern.groups,
            },
        })));
        if let Some(spectrum) = &self.spectrum {
            all.extend(spectrum_json(spectrum));
        }
        if let Some(existence) = &self.existence {
            let verdict = exists::fields(existence, traits.contacts);
            all.insert("existence".into(), Value::Object(verdict));
        }
        all
    }

    /// As text.
    pub(super) fn text(&self, text: &mut String) {
        let traits = &self.traits;
        let dofs = match (traits.dofs, traits.density()) {
            (Some(n), Some(c)) => {
                let much = if c > 1.0 { " (hyperstatic)" } else { "" };
                format!("{n} degrees of freedom, contact density c = {c:.3}{much}")
            }
            _ => "degrees of freedom unknown, so contact density unknown".into(),
        };
        row(text, "density", dofs);
        let MuRange { min, max, frictionless } = traits.mu;
        let mu = if traits.contacts == 0 {
            "no contacts".into()
        } else if min == max {
            format!("mu = {min}")
        } else {
            format!("mu from {min} to {max}, {} without friction", count(frictionless, "contact"))
        };
        row(text, "friction", mu);
        if let Some(MuRange { min, max, .. }) = traits.mu_r {
            let m = if min == max { format!("{min} m") } else { format!("from {min} to {max} m") };
            row(text, "rolling", format!("mu_r = {m}"));
        }
        let pattern = &traits.W;
        let blocks = format!(
            "{} of {d} x {d}, by row {} to {}, {:.1} on average; {}",
            count(pattern.blocks, "block"),
            pattern.row_min,
            pattern.row_max,
            pattern.row_mean(),
            count(pattern.groups, "connected group"),
            d = traits.kind.dimension(),
        );
        let symmetry = symmetry(traits.asymmetry);
        match &traits.mass {
            None => row(text, "W", format!("{blocks}, {symmetry}")),
            Some(Mass { entries, components }) => {
                let m = format!("{} entries, {symmetry}, {}", entries.M, sizes(components));
                row(text, "M", m);
                if let Some(e) = &self.singular {
                    row(text, "", format!("M is singular: {e}"));
                }
                row(text, "H", format!("{} entries", entries.H));
                row(text, "W", format!("if condensed: {blocks}"));
            }
        }
        if let Some(spectrum) = &self.spectrum {
            row(text, "spectrum", spectrum_text(spectrum));
        }
        if let Some(existence) = &self.existence {
            row(text, "existence", existence);
        }
        if traits.bilateral_rows > 0 {
            row(text, "bilateral", count(traits.bilateral_rows, "row"));
        }
    }
}

/// `diagonal`, or `61 components of size 6` and so on for the most frequent sizes.
fn sizes(components: &[Components]) -> String {
    if matches!(components, [Components { size: 1, .. }]) {
        return "diagonal".into();
    }
    const SHOWN: usize = 4;
    let first = components.iter().take(SHOWN);
    let text = |c: &Components| format!("{} of size {}", count(c.count, "component"), c.size);
    let mut texts: Vec<_> = first.map(text).collect();
    let rest: usize = components.iter().skip(SHOWN).map(|c| c.count).sum();
    if rest > 0 {
        texts.push(format!("{rest} of other sizes"));
    }
    texts.join(", ")
}

/// What the singular values of W say, or why there are none; null where W is zero.
fn spectrum_json(spectrum: &Result<Spectrum, String>) -> Object {
    let refused = spectrum.as_ref().err();
    let said = spectrum.as_ref().ok().map(|s| {
        json!({
            "rank": s.rank,
            "rank_ratio": s.rank_ratio(),
            "condition": s.condition(),
            "largest": s.largest,
            "least": s.least,
            "dropped": s.dropped,
            "skew": s.skew,
        })
    });
    report::fields(json!({"spectrum": said, "spectrum_refused": refused}))
}

fn spectrum_text(spectrum: &Result<Spectrum, String>) -> String {
    let s = match spectrum {
        Ok(spectrum) => spectrum,
        Err(refused) => return format!("none: {refused}"),
    };
    let (Some(ratio), Some(condition)) = (s.rank_ratio(), s.condition()) else {
        return "W is zero".into();
    };
    format!(
        "rank {} of {}, rank ratio {ratio:.3}, condition number {}, singular values {} to {} 1/kg",
        s.rank,
        s.rows,
        number(condition),
        number(s.least),
        number(s.largest),
    )
}
