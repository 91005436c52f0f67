//! What a certificate is worth: a proof in exact arithmetic, something that holds up to rounding, or nothing.

use serde::{Deserialize, Serialize};

use nonsmooth_linalg::budget;

use super::cones::ConeSystem;
use super::exact::Exact;
use super::sectors::Claimed;
use super::statement::Exactly;
use crate::check::Certificate;

/// What the judge makes of a [`Certificate`].
#[derive(Debug, Clone, PartialEq)]
pub enum Evidence {
    /// It proves, in exact rational arithmetic on the stored doubles, that there is no solution.
    Proved(Proof),
    /// It would prove that for data that differ from those stored by this relative change, which is rounding (below 1e-9).
    Nearly {
        /// The smallest relative change of the entries that makes the certificate true, up to a factor of two.
        change: f64,
    },
    /// It proves nothing.
    Nothing,
}

impl Evidence {
    /// Whether the certificate holds, if only up to rounding.
    pub fn holds(&self) -> bool {
        !matches!(self, Self::Nothing)
    }
}

/// Proof that a problem has no solution: vectors that separate the right-hand side of its [`ConeSystem`] from every choice of one column a pair. Only the judge
/// makes one, after it has verified it in exact arithmetic.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Proof {
    /// What was claimed, in doubles.
    #[serde(flatten)]
    certificate: Certificate,
    /// What was verified: of each vector the entries that are not zero.
    exact: Vec<Sparse>,
    #[serde(skip)]
    margin: f64,
}

/// The entries of a vector that are not zero, by row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
struct Sparse(Vec<(usize, Number)>);

/// A rational number; as text `p` or `p/q`.
#[derive(Debug, Clone, PartialEq)]
struct Number(Exact);

impl Serialize for Number {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let wrong = || {
            serde::de::Error::custom(format!(
                "expected a fraction such as \"-3/4\", found {text:?}"
            ))
        };
        // A text of hostile length would take for ever.
        if text.len() > 1_000_000 {
            return Err(serde::de::Error::custom("a fraction of more than a million digits"));
        }
        let nothing = |q: &str| q.trim_matches(['+', '-', '_', '0']).is_empty();
        if text.split_once('/').is_some_and(|(_, q)| nothing(q)) {
            return Err(wrong());
        }
        text.parse().map(Self).map_err(|_| wrong())
    }
}

impl Proof {
    /// Of the vectors those at the given places, which are what proves.
    fn new(
        certificate: &Certificate,
        vectors: &[Vec<Exact>],
        (places, margin): (Vec<usize>, f64),
    ) -> Self {
        let sparse = |k: &usize| {
            let entries = vectors[*k].iter().enumerate().filter(|(_, y)| !y.is_zero());
            Sparse(entries.map(|(i, y)| (i, Number(y.clone()))).collect())
        };
        let exact = places.iter().map(sparse).collect();
        Self { certificate: certificate.of(&places), exact, margin }
    }

    /// What was claimed.
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// By how much there is no solution: whatever the unknowns, some row is missed by at least this part of the largest right-hand side; rows that balance impulses count over their masses. Where it is of the size of
    /// rounding, a problem that was meant to have a solution may have lost it to the digits with which it was stored.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// The vectors that a written proof holds, for a system of so many rows, as a claim that the judge has yet to verify. `None` where an entry is
    /// beyond the rows, or a row appears twice.
    ///
    /// Errors: JSON of another shape.
    pub fn claimed(exact: &serde_json::Value, rows: usize) -> Result<Option<Certificate>, String> {
        let all: Vec<Sparse> = Deserialize::deserialize(exact).map_err(|e| e.to_string())?;
        let full = |Sparse(entries): Sparse| {
            let mut y = vec![Exact::ZERO; rows];
            for (i, Number(x)) in entries {
                let entry = y.get_mut(i).filter(|y| y.is_zero())?;
                *entry = x;
            }
            Some(ExactVector(y))
        };
        let vectors: Option<Vec<_>> = all.into_iter().map(full).collect();
        Ok(vectors.map(|vectors| Certificate::Separating { vectors }))
    }

    /// The number of vectors: one, or one for each family of complementary cones.
    pub fn vectors(&self) -> usize {
        self.exact.len()
    }
}

impl std::fmt::Display for Proof {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.certificate.fmt(f)
    }
}

/// What the certificate is worth for the problem.
///
/// Cost: the rows of the certificate's support, a look at each entry and a rational operation at those of columns that doubled precision does not decide, and where it
/// holds only nearly an elimination among them. Where the computation of this thread is [over](nonsmooth_linalg::budget::over) it is worth nothing.
pub(crate) fn weigh(problem: &impl Exactly, certificate: &Certificate) -> Evidence {
    let rows = problem.rows();
    let Some(claims) = claims(certificate, rows, problem.impulses_from()) else {
        return Evidence::Nothing;
    };
    if matches!(&claims[..], [alone] if !problem.is_plausible(alone)) {
        return Evidence::Nothing;
    }
    let wanted: Vec<bool> = (0..rows).map(|i| claims.iter().any(|y| y.touches(i))).collect();
    let Some(system) = problem.system(Some(&wanted)) else { return Evidence::Nothing };
    let vectors: Vec<Vec<Exact>> = claims.into_iter().map(|y| y.over(&system)).collect();
    let seen = system.entries();
    let weights: Vec<f64> = (0..rows).map(|i| problem.weight(i)).collect();
    if let Some(found) = system.refutation(&seen, &vectors, &weights) {
        return Evidence::Proved(Proof::new(certificate, &vectors, found));
    }
    if let (Certificate::Separating { .. }, Some(claimed)) =
        (certificate, Claimed::new(&system, &seen, &vectors))
    {
        if let Some(found) = claimed.refutation(&weights) {
            return Evidence::Proved(Proof::new(certificate, &vectors, found));
        }
        if let Some(change) = claimed.nearness() {
            return Evidence::Nearly { change };
        }
    }
    // First as they are, then without the entries that may be noise.
    let mut nearly: Option<f64> = None;
    let entries: usize = system.columns.iter().map(Vec::len).sum();
    let tries: &[f64] =
        if entries * vectors.len() <= MANY { &[0.0, 1e-13, 1e-10, 1e-7, 1e-4] } else { &[0.0] };
    let mut last: Option<Vec<Vec<Exact>>> = None;
    for &noise in tries {
        if budget::over() {
            return Evidence::Nothing;
        }
        let given = system.without(&vectors, noise);
        // The same entries come to the same.
        if last.as_ref() == Some(&given) {
            continue;
        }
        let mended = Some(system.mended(&seen, &given)).filter(|mended| *mended != given);
        for candidate in mended.iter().chain([&given]) {
            if let Some(found) = system.refutation(&seen, candidate, &weights) {
                return Evidence::Proved(Proof::new(certificate, candidate, found));
            }
            let change = system.nearness(&seen, candidate);
            nearly = change.into_iter().chain(nearly).reduce(f64::min);
        }
        last = Some(given);
    }
    nearly.map_or(Evidence::Nothing, |change| Evidence::Nearly { change })
}

/// Beyond so many entries noise is not looked for: rational arithmetic would take seconds.
const MANY: usize = 100_000;

/// A vector over the rows of the problem, as claimed.
pub(crate) enum Claim {
    Doubles(Vec<f64>),
    Exact(Vec<Exact>),
}

impl Claim {
    fn touches(&self, row: usize) -> bool {
        match self {
            Self::Doubles(y) => y.get(row).is_some_and(|y| *y != 0.0),
            Self::Exact(y) => y.get(row).is_some_and(|y| !y.is_zero()),
        }
    }

    fn over(self, system: &ConeSystem) -> Vec<Exact> {
        match self {
            Self::Doubles(y) => system.vector(&y),
            // Rows that define bounds are part of an exact vector.
            Self::Exact(mut y) => {
                let short = y.len() < system.rhs.len();
                y.resize(system.rhs.len(), Exact::ZERO);
                if short {
                    system.complete(&mut y);
                }
                y
            }
        }
    }
}

/// The vectors that a certificate claims to separate. `None` where its shape is wrong or a value is not finite.
fn claims(certificate: &Certificate, rows: usize, impulses: Option<usize>) -> Option<Vec<Claim>> {
    let finite = |y: &[f64]| y.iter().all(|y| y.is_finite());
    let doubles = |y: &Vec<f64>| (y.len() == rows && finite(y)).then(|| Claim::Doubles(y.clone()));
    match certificate {
        &Certificate::Row { row } => {
            let mut y = vec![0.0; rows];
            *y.get_mut(row)? = 1.0;
            Some(vec![Claim::Doubles(y)])
        }
        Certificate::Farkas { y } => Some(vec![doubles(y)?]),
        Certificate::Ray { z, z0 } => (*z0 == 0.0).then(|| doubles(z))?.map(|y| vec![y]),
        Certificate::Cones { separating } => separating.iter().map(doubles).collect(),
        Certificate::Impulses(given) => {
            let first = impulses?;
            let y = [&vec![0.0; first][..], &given.r, &given.lambda].concat();
            Some(vec![doubles(&y)?])
        }
        Certificate::Separating { vectors } => {
            let long = vectors.iter().all(|y| y.0.len() >= rows);
            long.then(|| vectors.iter().map(|y| Claim::Exact(y.0.clone())).collect())
        }
    }
}

/// An exact vector over all rows of a [`ConeSystem`], those that define bounds included; in files a list of texts.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactVector(pub Vec<Exact>);

impl Serialize for ExactVector {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|x| Number(x.clone())))
    }
}

impl<'de> Deserialize<'de> for ExactVector {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let all = Vec::<Number>::deserialize(deserializer)?;
        Ok(Self(all.into_iter().map(|n| n.0).collect()))
    }
}
