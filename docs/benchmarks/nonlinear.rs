//! What the page of nonlinear problems adds to that of `bench page`: the eight solvers of the 1997 comparison among themselves, beside published counts and other programs.
//!
//! `cargo run --release -p nonsmooth-figures --example nonlinear -- RUNS.jsonl [MANIFEST.csv]` prints it; docs/benchmarks/nonlinear.sh puts it where it belongs. The manifest
//! has a row for each file, with the natural residuals that other programs reach.
//!
//! References: BillupsDirkseFerris1997 (what is counted); Munson2002, tables 33 to 37 and 54 to 58 (published counts); Acary2018 (which solvers are ahead).

use std::collections::BTreeMap;
use std::path::Path;

use nonsmooth_bench::profile::Selection;
use nonsmooth_bench::record::Run;
use nonsmooth_bench::runs::Runs;
use nonsmooth_bench::tables::{Table, competitive};

/// The eight, as the lecture lists them.
const EIGHT: [&str; 8] =
    ["miles", "path", "ne_sqp", "qpcomp", "smooth", "proxi", "semismooth", "semicomp"];
/// Those that the lecture says are superior.
const AHEAD: [&str; 3] = ["proxi", "path", "smooth"];
const KIND: &str = "mcp";
/// The natural residual at which a problem counts as solved in what was published.
const TOLERANCE: f64 = 1e-6;

/// Solved and all runs of a problem by PATH 2.9, by PATH 4 and by SEMI, the last two with restarts. Their starts need not be ours.
const PUBLISHED: &[(&str, [(u32, u32); 3])] = &[
    ("bertsekas", [(6, 6); 3]),
    ("billups", [(0, 3); 3]),
    ("choi", [(1, 1); 3]),
    ("colvdual", [(4, 4); 3]),
    ("colvnlp", [(6, 6); 3]),
    ("ehl_k40", [(2, 3), (3, 3), (3, 3)]),
    ("ehl_k60", [(3, 3); 3]),
    ("ehl_k80", [(3, 3); 3]),
    ("ehl_kost", [(3, 3); 3]),
    ("explcp", [(1, 1); 3]),
    ("freebert", [(7, 7); 3]),
    ("hansmcp", [(1, 1); 3]),
    ("harkmcp", [(4, 4); 3]),
    ("hydroc06", [(1, 1); 3]),
    ("hydroc20", [(1, 1); 3]),
    ("josephy", [(8, 8); 3]),
    ("kojshin", [(8, 8); 3]),
    ("mathinum", [(6, 6); 3]),
    ("mathisum", [(6, 6); 3]),
    ("methan08", [(1, 1); 3]),
    ("mr5mcp", [(1, 1); 3]),
    ("munson4", [(3, 3); 3]),
    ("nash", [(4, 4); 3]),
    ("nehard", [(0, 1), (1, 1), (0, 1)]),
    ("obstacle", [(8, 8); 3]),
    ("oligomcp", [(1, 1); 3]),
    ("pies", [(1, 1); 3]),
    ("powell_mcp", [(6, 6); 3]),
    ("scarfmcp", [(1, 1); 3]),
    ("transmcp", [(3, 3); 3]),
    ("vonthmcp", [(1, 1), (1, 1), (0, 1)]),
    ("wallmcp", [(1, 1); 3]),
];

/// The columns of the manifest, with what they hold.
const PEERS: [(&str, &str); 5] = [
    ("ipopt_pen_res", "Ipopt, penalty"),
    ("ipopt_rel_res", "Ipopt, relaxation"),
    ("siconos_mcp_fb_res", "Siconos, Newton on Fischer–Burmeister"),
    ("siconos_mcp_min_res", "Siconos, Newton on the minimum"),
    ("siconos_vi_qi_res", "Siconos, variational inequality with a box"),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("expected RUNS.jsonl [MANIFEST.csv], found nothing")?;
    let runs = Runs::read(Path::new(&file)).map_err(|e| e.to_string())?;
    let manifest = arguments.next();
    print!("{}{}", problems(manifest.is_some()), among_themselves(&runs));
    if let Some(manifest) = manifest {
        print!("{}{}", published(&runs), peers(&runs, Path::new(&manifest))?);
    }
    Ok(())
}

/// Where the problems are from.
fn problems(published: bool) -> &'static str {
    if published {
        "\n## The problems\n\nProblems of MCPLIB, of GAMS' library and of papers, written anew as AMPL's `.nl` files, one a start; a family is a problem with all its starts, and \
         `degenerate_ncp` is small ones that are degenerate or singular at their solution. They are not distributed with this project: they are the files `P*.nl` of \
         `$NONSMOOTH_CORPUS/mcp`, and where that is not set the same command takes the families of [suite-nonlinear.toml](benchmarks/suite-nonlinear.toml).\n"
    } else {
        "\n## The problems\n\nThe families of [suite-nonlinear.toml](benchmarks/suite-nonlinear.toml), made by `nonsmooth gen`.\n"
    }
}

fn table(head: &[&str], rows: Vec<Vec<String>>) -> String {
    Table { head: head.iter().map(|h| (*h).to_owned()).collect(), rows }.markdown()
}

/// The eight without `auto`, and whether the lecture's three are ahead.
fn among_themselves(runs: &Runs) -> String {
    let eight =
        Selection { solvers: EIGHT.map(String::from).into(), ..Selection::at(KIND, TOLERANCE) };
    let counted = competitive(runs, &eight);
    let mut text = format!(
        "\n## The eight among themselves\n\nThe least time T_min is that of the eight here, without `auto`.\n\n{}\n\
         The lecture (Acary2018) reports of comparisons of these codes that PROXI, PATH and SMOOTH are superior. Of our solvers of these names:\n\n",
        counted.markdown()
    );
    let columns = [(2, "solved"), (4, "within twice the least time"), (3, "within 4/3 of it")];
    for (column, what) in columns {
        let count = |row: &Vec<String>| row[column].parse().unwrap_or(0);
        let mut order: Vec<(&str, u32)> =
            counted.rows.iter().map(|r| (r[0].as_str(), count(r))).collect();
        order.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        // Those that fewer than three are before.
        let third = order.get(2).map_or(0, |o| o.1);
        let (first, behind): (Vec<&str>, Vec<&str>) =
            AHEAD.iter().partition(|name| order.iter().any(|o| o.0 == **name && o.1 >= third));
        let list: Vec<_> = order.iter().map(|(s, n)| format!("`{s}` {n}")).collect();
        let word = match (first.as_slice(), behind.as_slice()) {
            (_, []) => "confirmed".to_owned(),
            ([], _) => "not confirmed: none of the three is among the first three".to_owned(),
            (some, rest) => format!(
                "confirmed of `{}`, not of `{}`, by the first three places",
                some.join("` and `"),
                rest.join("` and `")
            ),
        };
        text += &format!("- *{what}*: {}; {word}.\n", list.join(", "));
    }
    text
}

/// The runs at the tolerance, by solver.
fn of<'a>(runs: &'a Runs, solver: &'a str) -> impl Iterator<Item = &'a Run> {
    runs.runs
        .iter()
        .filter(move |r| r.kind == KIND && r.tolerance == TOLERANCE && r.solver == solver)
}

/// PATH and SEMI, problem by problem.
fn published(runs: &Runs) -> String {
    let (mut rows, mut below) = (vec![], [vec![], vec![]]);
    let solvers = ["path", "semismooth", "auto"];
    for (name, counts) in PUBLISHED {
        let ours = solvers.map(|solver| {
            let mine = |r: &&Run| {
                let rest = r.family.strip_prefix(name);
                rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_lowercase()))
            };
            let all: Vec<_> = of(runs, solver).filter(mine).collect();
            (all.iter().filter(|r| r.solved()).count() as u32, all.len() as u32)
        });
        if ours[0].1 == 0 {
            continue;
        }
        // The better of the two versions of PATH.
        let shares = |(solved, all): (u32, u32)| f64::from(solved) / f64::from(all.max(1));
        let best = shares(counts[0]).max(shares(counts[1]));
        for (k, goal) in [best, shares(counts[2])].into_iter().enumerate() {
            if shares(ours[k]) < goal {
                below[k].push(format!("{name} {}/{}", ours[k].0, ours[k].1));
            }
        }
        let [p, s, a] = ours;
        let cells = [p, counts[0], counts[1], s, counts[2], a].map(|(n, m)| format!("{n}/{m}"));
        rows.push(std::iter::once((*name).to_owned()).chain(cells).collect());
    }
    let n = rows.len();
    let said = |below: &[String]| match below {
        [] => format!("reaches the published share on all {n} problems"),
        some => format!(
            "reaches the published share on {} of {n} problems, not on {}",
            n - some.len(),
            some.join(", ")
        ),
    };
    format!(
        "\n## Beside the published PATH and SEMI\n\nSolved starts of all, by problem. The published counts (Munson2002, PATH 4 and SEMI with restarts) are of other starts where their numbers differ, and of models of the \
         same name: variants of a problem are counted with it here. `path` {}; `semismooth` {}.\n\n{}",
        said(&below[0]),
        said(&below[1]),
        table(&["problem", "path", "PATH 2.9", "PATH 4", "semismooth", "SEMI", "auto"], rows)
    )
}

/// Other programs on the same files, by the natural residual of their answers.
fn peers(runs: &Runs, manifest: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let mut reached: BTreeMap<String, [Option<f64>; 5]> = BTreeMap::new();
    let mut reader = csv::Reader::from_path(manifest)?;
    for row in reader.deserialize::<BTreeMap<String, String>>() {
        let row = row?;
        let of = |column: &str| row.get(column).and_then(|x| x.parse().ok());
        let stem = row.get("file").and_then(|f| f.strip_suffix(".nl")).unwrap_or_default();
        reached.insert(stem.to_owned(), PEERS.map(|(column, _)| of(column)));
    }
    let stem = |r: &Run| r.problem.rsplit('/').next().unwrap_or_default().to_owned();
    let files: Vec<String> =
        of(runs, "auto").map(stem).filter(|f| reached.contains_key(f)).collect();
    let small = |x: Option<f64>| x.is_some_and(|x| x <= TOLERANCE);
    let mut counts: Vec<(String, usize)> = std::iter::once("auto")
        .chain(EIGHT)
        .map(|solver| {
            let good = |r: &&Run| files.contains(&stem(r)) && small(r.residuals.absolute);
            (format!("`{solver}`"), of(runs, solver).filter(good).count())
        })
        .collect();
    for (k, (_, name)) in PEERS.iter().enumerate() {
        let good = files.iter().filter(|f| small(reached[*f][k])).count();
        counts.push(((*name).to_owned(), good));
    }
    counts.sort_by_key(|c| std::cmp::Reverse(c.1));
    let rows = counts.into_iter().map(|(name, n)| vec![name, n.to_string()]).collect();
    Ok(format!(
        "\n## Beside other programs\n\nFiles of {} whose answer has a natural residual `‖x − mid(l, u, x − F(x))‖_∞` of at most 1e-6, absolute and not in the judge's units, from the same starts:\n\n{}",
        files.len(),
        table(&["solver", "files"], rows)
    ))
}
