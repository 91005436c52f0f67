//! Traits and spectra against closed forms, against what is published of the same problems, and against what another
//! program counted in the same files.

use std::collections::HashMap;
use std::path::Path;

use nonsmooth::{Bsr, Friction, Scene, fclib};
use nonsmooth_analysis::{Spectrum, Traits};
use nonsmooth_bench::traits_table::{self, Column};
use nonsmooth_scenes::scenes::{Family, SlidingBox, Stack};

/// The spectra of the global and of the condensed problem of a scene, which agree.
fn spectra(scene: &Scene) -> [Spectrum; 2] {
    let (global, local) = (scene.problem().unwrap(), scene.condensed().unwrap());
    let both = [Spectrum::of_global(&global, 1000), Spectrum::of_local(&local, 1000)];
    let [global, local] = both.map(Result::unwrap);
    assert_eq!((global.rows, global.rank), (local.rows, local.rank), "{}", scene.name);
    let conditions = [global, local].map(|s| s.condition().unwrap());
    assert!((conditions[0] / conditions[1] - 1.0).abs() < 1e-7, "{}: {conditions:?}", scene.name);
    [global, local]
}

/// A box with half sides a, b, c on its four bottom corners has `H M⁻¹ Hᵀ ~ Σ_corners [I, P; Pᵀ, P Pᵀ]` with
/// `P = M^½ [p×] J^{-½}`. With `J_x = m (b² + c²) / 3`, … the eigenvalues are, times 4/m: 1 (heave), 3 (yaw), and of
/// sway with roll `2 ± √(1 + 3 c² / (b² + c²))`, of surge with pitch the same with a.
#[test]
fn a_box_on_its_corners_has_the_spectrum_of_its_closed_form() {
    for (length, width, height) in [(1.0, 1.0, 1.0), (0.4, 0.3, 0.2), (0.2, 0.9, 0.7)] {
        let scene = SlidingBox { length, width, height, ..Default::default() }.build().unwrap();
        let pair = |side: f64, sign: f64| {
            2.0 + sign * (1.0 + 3.0 * height * height / (side * side + height * height)).sqrt()
        };
        let all =
            [1.0, 3.0, pair(length, 1.0), pair(length, -1.0), pair(width, 1.0), pair(width, -1.0)];
        let scaled = all.map(|x| 4.0 * x / scene.mass());
        let largest = scaled.iter().copied().fold(0.0, f64::max);
        let least = scaled.iter().copied().fold(f64::INFINITY, f64::min);
        for found in spectra(&scene) {
            assert_eq!((found.rows, found.rank, found.rank_ratio()), (12, 6, Some(2.0)));
            assert!((found.largest / largest - 1.0).abs() < 1e-12, "{found:?} {largest}");
            assert!((found.least / least - 1.0).abs() < 1e-12, "{found:?} {least}");
        }
    }
}

/// k boxes stand on 4 k contacts: 12 k rows, and the boxes can move in all of their 6 k directions.
#[test]
fn a_stack_of_boxes_is_twice_hyperstatic() {
    for count in [2, 7, 12] {
        let scene = Stack { count, ..Default::default() }.build().unwrap();
        for found in spectra(&scene) {
            assert_eq!((found.rows, found.rank), (12 * count, 6 * count));
        }
    }
}

/// Problems of FCLIB's own families, among Siconos' test data: what we compute lies in what is published of the
/// family, its mean asymmetry aside, of which the order of magnitude is compared.
#[test]
fn problems_of_fclib_have_the_traits_that_are_published() {
    let published = traits_table::published();
    let named = [("BoxesStack", 1e2), ("Capsules", 3.0), ("KaplasTower", 30.0), ("PerioBox", 10.0)];
    let mut met = HashMap::new();
    for path in crate::common::corpus_files(&["siconos/fc3d"]) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let Some((family, factor)) = named.iter().find(|(family, _)| name.contains(family)) else {
            continue;
        };
        let known =
            published.iter().find(|p| p.name.to_lowercase().contains(&family.to_lowercase()));
        let known = known.unwrap();
        let problem = fclib::read_problem(&path).unwrap();
        let found = Spectrum::of(&problem, 2000).unwrap();
        let within = |column, x: f64| {
            let span = known.span(column);
            assert!(
                span.is_none_or(|s| s.holds(x, 0.01)),
                "{name}: {column:?} {x} not in {span:?}"
            );
        };
        within(Column::Contacts, problem.contacts() as f64);
        within(Column::RankRatio, found.rank_ratio().unwrap());
        within(Column::Condition, found.condition().unwrap());
        let skew = known.span(Column::Skew).unwrap().min;
        let off = (found.skew / skew).max(skew / found.skew);
        assert!(off < *factor, "{name}: {} where the mean is {skew}", found.skew);
        *met.entry(*family).or_insert(0) += 1;
    }
    assert!(met.is_empty() || met.len() == named.len(), "{met:?}");
}

/// The manifest counted unknowns, the stored entries of W or H, and the asymmetry `max |a_ij − a_ji| / max |a_ij|` of
/// W or M, to two digits.
#[test]
fn the_corpus_has_the_traits_of_its_manifest() {
    let files = crate::common::corpus_files(&[""]);
    if files.is_empty() {
        return;
    }
    let corpus = std::env::var_os("NONSMOOTH_CORPUS").unwrap();
    let corpus = Path::new(&corpus);
    let mut manifest = csv::Reader::from_path(corpus.join("manifest.csv")).unwrap();
    let mut compared = HashMap::new();
    for row in manifest.deserialize() {
        let row: HashMap<String, String> = row.unwrap();
        let Ok(problem) = fclib::read_problem(corpus.join(&row["file"])) else {
            continue; // Other formats: the io crate's tests see to it.
        };
        compare(&row, &problem);
        *compared.entry(row["kind"].clone()).or_insert(0) += 1;
    }
    let enough = ["fclib_local", "fclib_global"].map(|kind| compared.get(kind) >= Some(&30));
    assert_eq!(enough, [true; 2], "{compared:?}");
}

fn compare(row: &HashMap<String, String>, problem: &Friction) {
    let traits = Traits::of(problem, None);
    // Some files were counted in part.
    let is = |key: &str, agrees: &dyn Fn(f64) -> bool| {
        let said = &row[key];
        let agrees = said.is_empty() || agrees(said.parse().unwrap());
        assert!(agrees, "{}: {key} is {said} in the manifest, found {traits:?}", row["file"]);
    };
    is("nc", &|nc| nc == traits.contacts as f64);
    is("m", &|m| m == traits.impulses() as f64);
    is("mu_min", &|mu| (mu - traits.mu.min).abs() < 0.01);
    is("mu_max", &|mu| (mu - traits.mu.max).abs() < 0.01);
    // A stored block holds entries that the file does not, as zeros.
    let stored = traits.kind.dimension().pow(2) * traits.W.blocks;
    let (largest, [least, most]) = match (problem, &traits.mass) {
        (Friction::Local2(p), _) => of_w(&p.W, stored),
        (Friction::Local3(p), _) => of_w(&p.W, stored),
        (Friction::RollingLocal(p), _) => of_w(&p.W, stored),
        (_, mass) => (traits.asymmetry, [mass.as_ref().unwrap().entries.H; 2]),
    };
    is("nnz", &|nnz| (least as f64..=most as f64).contains(&nnz));
    is("asym", &|asym| (largest - asym).abs() <= 0.051 * largest);
    // In another norm of the same matrix: each is at most m times the other.
    let (rows, other) = (traits.impulses() as f64, traits.asymmetry);
    let near = other <= rows * largest && largest <= rows * other;
    assert!(near, "{}: {other}, {largest}", row["file"]);
    if traits.mass.is_some() {
        is("ndof", &|n| Some(n as usize) == traits.dofs);
    }
}

/// The asymmetry of W by its largest entries, and the bounds of the number of entries that a file may hold for it.
fn of_w<const D: usize>(w: &Bsr<D>, stored: usize) -> (f64, [usize; 2]) {
    let nonzero = w.blocks().iter().flatten().flatten().filter(|&&x| x != 0.0).count();
    (w.to_csc().asymmetry(), [nonzero, stored])
}
