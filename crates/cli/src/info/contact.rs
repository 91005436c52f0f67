//! What `nonsmooth info` says of frictional contact problems.

use std::path::Path;

use nonsmooth_analysis::{Components, Mass, MuRange, Spectrum, Traits};
use nonsmooth_io::fclib::{FclibFile, StoredPoint};
use nonsmooth_linalg::Inverse;
use nonsmooth_problem::check::{ContactStatus, Existence, StatusCounts};
use nonsmooth_problem::{Dynamics, Friction, FrictionGlobal, ProblemError};
use serde_json::{Value, json};

use super::{JUDGED_AT, symmetry};
use crate::exists;
use crate::kinds::Form;
use crate::report::{self, Object, count, number, row};

/// What there is to say of a problem.
pub(super) struct Facts {
    sizes: Object,
    size_text: String,
    traits: Traits,
    /// Why a global problem's dynamics cannot be inverted, so that there is nothing to solve.
    pub(super) singular: Option<ProblemError>,
    /// If asked for, or cheap.
    pub(super) existence: Option<Existence>,
    /// If asked for.
    pub(super) spectrum: Option<Result<Spectrum, String>>,
    solution: Option<nonsmooth_problem::check::Verdict>,
}

/// Everything about a problem but its spectrum and the existence of a solution.
pub(super) fn facts<P>(file: &Path, problem: &P, content: &FclibFile) -> Result<Facts, String>
where
    P: Form<Stored = StoredPoint, Status = ContactStatus, Counts = StatusCounts>,
{
    let judge = |stored| problem.judge(&problem.point(stored), JUDGED_AT);
    let solution = match content.solution.as_ref().map(judge).transpose() {
        // Said of M.
        Err(ProblemError::Singular { .. }) => None,
        judged => judged.map_err(|e| format!("{}: {e}", file.display()))?,
    };
    Ok(Facts {
        sizes: report::problem_json(file, problem),
        size_text: report::problem_text(problem),
        traits: Traits::of(&content.problem, content.info.dofs),
        singular: match &content.problem {
            Friction::Local2(_) | Friction::Local3(_) => None,
            Friction::Global2(p) => singular(p),
            Friction::Global3(p) => singular(p),
        },
        existence: None,
        spectrum: None,
        solution,
    })
}

/// A short search for existence takes up to about a second with so many contacts, unless a body has many unknowns.
const FEW_CONTACTS: usize = 2000;
/// Unknowns of a rigid body or a small elastic one.
const SMALL_BODY: usize = 48;

fn singular<const D: usize>(p: &FrictionGlobal<D>) -> Option<ProblemError> {
    // Bilateral constraints may make up for a singular M in the dynamics, but M⁻¹ is needed all the same.
    Inverse::new(&p.M, "M").err().map(ProblemError::from).or_else(|| {
        p.rows.as_ref()?;
        Dynamics::new(p).err()
    })
}

impl Facts {
    /// A short search for existence costs next to nothing.
    pub(super) fn is_small(&self) -> bool {
        let bodies = self.traits.mass.iter().flat_map(|m| &m.components);
        self.traits.contacts <= FEW_CONTACTS && bodies.map(|c| c.size).all(|s| s <= SMALL_BODY)
    }

    /// As JSON.
    pub(super) fn json(&self, content: &FclibFile) -> Value {
        let mut all = self.sizes.clone();
        let traits = &self.traits;
        all.extend(report::fields(json!({
            "title": content.info.title,
            "description": content.info.description,
            "form": if traits.mass.is_some() { "global" } else { "local" },
            "dimension": traits.kind.dimension(),
            "dofs": traits.dofs,
            "contact_density": traits.density(),
            "mu": traits.mu,
            "bilateral_rows": traits.bilateral_rows,
        })));
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
        all.extend(report::fields(json!({
            "guesses": content.guesses.len(),
            "solution": self.solution.as_ref().map(|v| report::verdict_json(v, JUDGED_AT, v.worst.len())),
        })));
        Value::Object(all)
    }

    /// As text.
    pub(super) fn text(&self, file: &Path, content: &FclibFile) -> String {
        let mut text = format!("{}: {}\n", file.display(), self.size_text);
        super::texts(&mut text, &content.info.title, &content.info.description);
        let traits = &self.traits;
        let dofs = match (traits.dofs, traits.density()) {
            (Some(n), Some(c)) => {
                let much = if c > 1.0 { " (hyperstatic)" } else { "" };
                format!("{n} degrees of freedom, contact density c = {c:.3}{much}")
            }
            _ => "degrees of freedom unknown, so contact density unknown".into(),
        };
        row(&mut text, "density", dofs);
        let MuRange { min, max, frictionless } = traits.mu;
        let mu = if min == max {
            format!("mu = {min}")
        } else {
            format!("mu from {min} to {max}, {} without friction", count(frictionless, "contact"))
        };
        row(&mut text, "friction", mu);
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
            None => row(&mut text, "W", format!("{blocks}, {symmetry}")),
            Some(Mass { entries, components }) => {
                let m = format!("{} entries, {symmetry}, {}", entries.M, sizes(components));
                row(&mut text, "M", m);
                if let Some(e) = &self.singular {
                    row(&mut text, "", format!("M is singular: {e}"));
                }
                row(&mut text, "H", format!("{} entries", entries.H));
                row(&mut text, "W", format!("if condensed: {blocks}"));
            }
        }
        if let Some(spectrum) = &self.spectrum {
            row(&mut text, "spectrum", spectrum_text(spectrum));
        }
        if let Some(existence) = &self.existence {
            row(&mut text, "existence", existence);
        }
        if traits.bilateral_rows > 0 {
            row(&mut text, "bilateral", count(traits.bilateral_rows, "row"));
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
