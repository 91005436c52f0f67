//! Families of problems by their traits, beside the families that FCLIB's authors tabulate.
//!
//! Source of the published rows: AcaryBremondHuber2018; the data and what is missing in them:
//! `data/fclib_families.csv`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use comfy_table::{TableStyle, presets};
use nonsmooth_analysis::{Spectrum, SpectrumError, Traits};
use nonsmooth_io::{IoError, ProblemFile};

/// Which published families are like a family of ours: ours, theirs. Sizes, time steps and coefficients of friction
/// differ. FCLIB has none of polyhedra (its capsules are another shape), nor of walls of rigid bricks.
const COUNTERPARTS: &[(&str, &[&str])] = &[
    ("stack", &["BoxesStack"]),
    ("kapla", &["KaplasTower"]),
    ("chain", &["Chain"]),
    ("chute", &["Chute_1000", "Chute_4000"]),
    ("sphere_pile", &["945_SP_Box_PL"]),
    ("periodic_box", &["100_PR_Periobox"]),
    ("bridge", &["Bridge_PR", "Aqueduct_PR"]),
    ("arch", &["Bridge_PR", "Aqueduct_PR"]),
    ("elastic_cubes", &["Cubes_H8_2", "Cubes_H8_5", "Cubes_H8_20"]),
    ("elastic_wall", &["LowWall_FEM"]),
];

/// A trait that families are compared by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Column {
    /// Coefficients of friction.
    Mu,
    /// Degrees of freedom n.
    Dofs,
    /// Contacts nc.
    Contacts,
    /// Contact density c = D nc / n.
    Density,
    /// m / rank W.
    RankRatio,
    /// Condition number of W over the singular values that are kept.
    Condition,
    /// Condition number of W as LSMR estimates it; published only.
    ConditionLsmr,
    /// The mean of `‖W − Wᵀ‖_F`, 1/kg. The publication does not name its norm; on FCLIB's own files this one
    /// gives the published order of magnitude.
    Skew,
}

impl Column {
    /// All, in the order of the table.
    pub const ALL: [Self; 8] = [
        Self::Mu,
        Self::Dofs,
        Self::Contacts,
        Self::Density,
        Self::RankRatio,
        Self::Condition,
        Self::ConditionLsmr,
        Self::Skew,
    ];

    /// The name in CSV files, before `_min` and `_max`.
    fn name(self) -> &'static str {
        match self {
            Self::Mu => "mu",
            Self::Dofs => "dofs",
            Self::Contacts => "contacts",
            Self::Density => "density",
            Self::RankRatio => "rank_ratio",
            Self::Condition => "condition",
            Self::ConditionLsmr => "condition_lsmr",
            Self::Skew => "skew",
        }
    }

    /// The head of the column in texts.
    fn head(self) -> &'static str {
        match self {
            Self::Mu => "mu",
            Self::Dofs => "n",
            Self::Contacts => "nc",
            Self::Density => "c",
            Self::RankRatio => "rank ratio",
            Self::Condition => "cond(W)",
            Self::ConditionLsmr => "cond(W), LSMR",
            Self::Skew => "mean ‖W − Wᵀ‖",
        }
    }

    fn number(self, x: f64) -> String {
        match self {
            Self::Mu => ((1000.0 * x).round() / 1000.0).to_string(),
            Self::Dofs | Self::Contacts => x.to_string(),
            Self::Density | Self::RankRatio if x >= 0.1 => format!("{x:.2}"),
            Self::Density | Self::RankRatio => format!("{x:.1e}"),
            Self::Condition | Self::ConditionLsmr | Self::Skew => format!("{x:.1e}"),
        }
    }
}

/// From the least to the largest value over a family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The least.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

impl Span {
    /// Over all values; `None` if there are none.
    pub fn over(values: impl Iterator<Item = f64>) -> Option<Self> {
        let join = |a: Self, b: Self| Self { min: a.min.min(b.min), max: a.max.max(b.max) };
        values.map(|x| Self { min: x, max: x }).reduce(join)
    }

    /// Whether a value lies within, up to `slack` of it: published bounds are rounded.
    pub fn holds(&self, x: f64, slack: f64) -> bool {
        (self.min * (1.0 - slack)..=self.max * (1.0 + slack)).contains(&x)
    }
}

/// A family of problems and the ranges of its traits.
#[derive(Debug, Clone, PartialEq)]
pub struct Family {
    /// Its name.
    pub name: String,
    /// Where it is from.
    pub source: String,
    /// The number of problems.
    pub problems: usize,
    /// The number of problems whose spectrum was computed, of which rank ratio, condition and skew speak. `None`: not
    /// published.
    pub spectra: Option<usize>,
    spans: BTreeMap<Column, Span>,
}

impl Family {
    /// The range of a trait, where it is known.
    pub fn span(&self, column: Column) -> Option<Span> {
        self.spans.get(&column).copied()
    }

    fn of(name: &str, members: &[&Described]) -> Self {
        let spectra: Vec<_> = members.iter().filter_map(|d| d.2.as_ref()).collect();
        let traits = |value: fn(&Traits) -> Option<f64>| {
            Span::over(members.iter().filter_map(|d| value(&d.1)))
        };
        let spectrum = |value: fn(&Spectrum) -> Option<f64>| {
            Span::over(spectra.iter().filter_map(|s| value(s)))
        };
        let mu = |d: &&Described| [d.1.mu.min, d.1.mu.max];
        let span = |column| match column {
            Column::Mu => Span::over(members.iter().flat_map(mu)),
            Column::Dofs => traits(|t| t.dofs.map(|n| n as f64)),
            Column::Contacts => traits(|t| Some(t.contacts as f64)),
            Column::Density => traits(Traits::density),
            Column::RankRatio => spectrum(Spectrum::rank_ratio),
            Column::Condition => spectrum(Spectrum::condition),
            Column::ConditionLsmr => None,
            Column::Skew => {
                let sum: f64 = spectra.iter().map(|s| s.skew).sum();
                let mean = sum / spectra.len() as f64;
                (!spectra.is_empty()).then_some(Span { min: mean, max: mean })
            }
        };
        Self {
            name: name.into(),
            source: "these files".into(),
            problems: members.len(),
            spectra: Some(spectra.len()),
            spans: Column::ALL.into_iter().filter_map(|c| Some((c, span(c)?))).collect(),
        }
    }
}

/// The families of FCLIB as published.
pub fn published() -> Vec<Family> {
    let data = include_str!("../data/fclib_families.csv");
    read_families(data).expect("the data of this crate are well formed: a test reads them")
}

/// Families by the columns `family`, `source`, `problems` and, for each [`Column`], its name with `_min` and `_max`.
fn read_families(text: &str) -> Result<Vec<Family>, csv::Error> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    reader
        .deserialize()
        .map(|row| {
            let row: BTreeMap<String, String> = row?;
            let text = |key: &str| row.get(key).map_or("", String::as_str);
            let number = |key: String| text(&key).parse().ok();
            let span = |column: Column| {
                let min = number(format!("{}_min", column.name()))?;
                let max = number(format!("{}_max", column.name()))?;
                Some((column, Span { min, max }))
            };
            Ok(Family {
                name: text("family").into(),
                source: text("source").into(),
                problems: text("problems").parse().unwrap_or(0),
                spectra: None,
                spans: Column::ALL.into_iter().filter_map(span).collect(),
            })
        })
        .collect()
}

/// A problem's file, its traits, and its spectrum if that was computed.
pub type Described = (PathBuf, Traits, Option<Spectrum>);

/// Why a file has no place in the table.
#[derive(Debug, thiserror::Error)]
pub enum DescribeError {
    /// It cannot be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// It has no spectrum, for another reason than its size.
    #[error("{}: {source}", file.display())]
    Spectrum {
        /// The file.
        file: PathBuf,
        /// The reason.
        source: SpectrumError,
    },
}

impl DescribeError {
    /// Whether the file is in order, but holds a problem without contacts.
    pub fn is_of_another_kind(&self) -> bool {
        matches!(self, Self::Io(IoError::NoContacts { .. }))
    }
}

/// Reads the problem of a file and describes it, with its spectrum where the dense matrix has at most `limit` rows.
pub fn describe(file: &Path, limit: usize) -> Result<Described, DescribeError> {
    let content = ProblemFile::read(file)?;
    let problem = content.contacts(file)?;
    let traits = Traits::of(problem, content.info.dofs);
    let spectrum = match Spectrum::of(problem, limit) {
        Ok(spectrum) => Some(spectrum),
        Err(SpectrumError::TooLarge { .. } | SpectrumError::Memory(_)) => None,
        Err(source) => return Err(DescribeError::Spectrum { file: file.into(), source }),
    };
    Ok((file.into(), traits, spectrum))
}

/// The families of the given problems, each followed by its published counterparts.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The families in the order of their names, each with its counterparts.
    pub families: Vec<(Family, Vec<Family>)>,
}

/// Groups problems by the folder that holds them, their family, and puts `published` families beside them.
pub fn table(problems: &[Described], published: &[Family]) -> Table {
    let mut groups: BTreeMap<String, Vec<&Described>> = BTreeMap::new();
    for problem in problems {
        groups.entry(family_of(&problem.0)).or_default().push(problem);
    }
    let families = groups.iter().map(|(name, members)| {
        let names = COUNTERPARTS.iter().find(|(ours, _)| ours == name).map_or(&[][..], |c| c.1);
        let like = published.iter().filter(|p| names.contains(&p.name.as_str()));
        (Family::of(name, members), like.cloned().collect())
    });
    Table { families: families.collect() }
}

/// The name of the folder that holds a file; `.` for a bare name.
fn family_of(file: &Path) -> String {
    let folder = file.parent().and_then(Path::file_name);
    folder.map_or(".".into(), |name| name.to_string_lossy().into_owned())
}

impl Table {
    /// For reading on a terminal.
    pub fn text(&self) -> String {
        self.drawn(presets::NOTHING)
    }

    /// As a table of Markdown.
    pub fn markdown(&self) -> String {
        self.drawn(presets::ASCII_MARKDOWN)
    }

    fn drawn(&self, style: TableStyle) -> String {
        let mut table = comfy_table::Table::new();
        let heads = ["family", "source", "problems", "spectra"];
        let columns = Column::ALL.map(Column::head);
        table.load_style(style).set_header(heads.iter().chain(&columns));
        for (family, _) in self.rows() {
            let spectra = family.spectra.map_or("–".into(), |n| n.to_string());
            let problems = family.problems.to_string();
            let mut row = vec![family.name.clone(), family.source.clone(), problems, spectra];
            row.extend(Column::ALL.map(|column| match family.span(column) {
                None => "–".into(),
                Some(Span { min, max }) => match (column.number(min), column.number(max)) {
                    (min, max) if min == max => min,
                    (min, max) => format!("{min} to {max}"),
                },
            }));
            table.add_row(row);
        }
        let lines: Vec<_> = table.lines().map(|line| line.trim_end().to_owned()).collect();
        lines.join("\n") + "\n"
    }

    /// As CSV: the columns of the published data, `spectra`, and `beside`, the family that a published one is set beside.
    pub fn csv(&self) -> Result<String, csv::Error> {
        let mut writer = csv::Writer::from_writer(vec![]);
        let ends = |c: Column| ["min", "max"].map(|end| format!("{}_{end}", c.name()));
        let heads = ["family", "source", "problems", "spectra", "beside"].map(str::to_owned);
        writer.write_record(heads.into_iter().chain(Column::ALL.into_iter().flat_map(ends)))?;
        for (family, beside) in self.rows() {
            let cell = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:?}"));
            let ends = |c| {
                let span = family.span(c);
                [cell(span.map(|s| s.min)), cell(span.map(|s| s.max))]
            };
            let sizes = [
                family.name.clone(),
                family.source.clone(),
                family.problems.to_string(),
                family.spectra.map_or(String::new(), |n| n.to_string()),
                beside.map_or(String::new(), |f| f.name.clone()),
            ];
            writer.write_record(sizes.into_iter().chain(Column::ALL.into_iter().flat_map(ends)))?;
        }
        let bytes = writer.into_inner().map_err(|e| e.into_error())?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Each family, then its counterparts with the family they are set beside.
    fn rows(&self) -> impl Iterator<Item = (&Family, Option<&Family>)> {
        self.families.iter().flat_map(|(ours, theirs)| {
            std::iter::once((ours, None)).chain(theirs.iter().map(move |p| (p, Some(ours))))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_problem::Friction;
    use nonsmooth_problem::planted::Planted;

    fn described(file: &str, contacts: usize, spectrum: bool) -> Described {
        let (problem, _) = Planted { contacts, dofs: 12, ..Planted::default() }.global::<3>();
        let problem = Friction::Global3(problem);
        let of = spectrum.then(|| Spectrum::of(&problem, 100).unwrap());
        (file.into(), Traits::of(&problem, None), of)
    }

    fn example() -> Table {
        let problems = [
            described("all/chute/a.hdf5", 8, true),
            described("all/chute/b.hdf5", 12, false),
            described("all/other/a.hdf5", 2, false),
            described("all/arch/a.hdf5", 16, true),
        ];
        table(&problems, &published())
    }

    #[test]
    fn published_families_are_complete_and_consistent() {
        let all = published();
        assert_eq!(all.len(), 15);
        // The publication's number of problems in all.
        assert_eq!(all.iter().map(|f| f.problems).sum::<usize>(), 2368);
        for family in &all {
            let of = |column| family.span(column);
            for column in Column::ALL {
                assert!(of(column).is_none_or(|s| s.min <= s.max), "{}: {column:?}", family.name);
            }
            for needed in [Column::Mu, Column::Dofs, Column::Contacts, Column::Density] {
                assert!(of(needed).is_some(), "{}: {needed:?}", family.name);
            }
            // c = 3 nc / n must meet what the ranges of nc and n allow; more the publication's own ranges do not keep.
            let (n, nc) = (of(Column::Dofs).unwrap(), of(Column::Contacts).unwrap());
            let allowed = Span { min: 3.0 * nc.min / n.max, max: 3.0 * nc.max / n.min };
            let c = of(Column::Density).unwrap();
            let meets = c.min <= 1.01 * allowed.max && allowed.min <= 1.01 * c.max;
            assert!(meets, "{}: {c:?} {allowed:?}", family.name);
        }
    }

    #[test]
    fn every_counterpart_is_a_published_family() {
        let all = published();
        for name in COUNTERPARTS.iter().flat_map(|c| c.1) {
            assert!(all.iter().any(|f| f.name == *name), "{name}");
        }
    }

    #[test]
    fn problems_are_grouped_by_their_folder() {
        let table = example();
        let names =
            |families: &[Family]| families.iter().map(|f| f.name.clone()).collect::<Vec<_>>();
        let ours: Vec<_> = table.families.iter().map(|f| f.0.clone()).collect();
        assert_eq!(names(&ours), ["arch", "chute", "other"]);
        assert_eq!(names(&table.families[0].1), ["Aqueduct_PR", "Bridge_PR"]);
        assert_eq!(names(&table.families[1].1), ["Chute_1000", "Chute_4000"]);
        assert!(table.families[2].1.is_empty());
        let chute = &ours[1];
        assert_eq!((chute.problems, chute.spectra), (2, Some(1)));
        assert_eq!(chute.span(Column::Contacts), Some(Span { min: 8.0, max: 12.0 }));
        assert_eq!(chute.span(Column::Density), Some(Span { min: 2.0, max: 3.0 }));
        // 24 rows of rank 12.
        assert_eq!(chute.span(Column::RankRatio), Some(Span { min: 2.0, max: 2.0 }));
        assert_eq!(chute.span(Column::Skew), Some(Span { min: 0.0, max: 0.0 }));
        assert_eq!(ours[2].span(Column::Condition), None);
        assert_eq!(family_of(Path::new("a.hdf5")), ".");
    }

    #[test]
    fn the_table_is_drawn_and_read_back() {
        let table = example();
        let rows = 1 + 3 + 4;
        assert_eq!(table.text().lines().count(), rows);
        let markdown = table.markdown();
        assert_eq!(markdown.lines().count(), rows + 1);
        assert!(markdown.lines().all(|l| l.starts_with('|') && l.ends_with('|')), "{markdown}");
        assert!(markdown.contains("8 to 12") && markdown.contains("15965 to 19795"), "{markdown}");
        let back = read_families(&table.csv().unwrap()).unwrap();
        let written = table.rows().map(|r| Family { spectra: None, ..r.0.clone() });
        assert_eq!(back, written.collect::<Vec<_>>());
    }
}
