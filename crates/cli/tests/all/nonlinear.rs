//! The commands on nonlinear complementarity problems.

use std::path::Path;

use crate::common::{Folder, has_keys};

/// A folder with the example.
fn folder() -> Folder {
    let folder = Folder::new();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/nash_cournot.toml");
    std::fs::copy(example, folder.path("nash.toml")).unwrap();
    let put = |name: &str, text: &str| std::fs::write(folder.path(name), text).unwrap();
    put("kink.toml", "kind = 'mcp'\nF = ['abs(x1) + x2', 'x2 - x1^2']\nlower = [-inf, 0]\n");
    put(
        "affine.toml",
        "kind = 'mcp'\nF = ['2*x1 - x2 - 1', 'x2 - (x1 - 3)/2']\nupper = [inf, 1]\n",
    );
    put("nowhere.toml", "kind = 'mcp'\nF = ['log(-1 - x1)']\n");
    folder
}

#[test]
fn the_example_is_solved_and_shown_by_name() {
    let folder = folder();
    folder.run("check nash.toml --tol 1e-12").exits(0);
    let text = folder.run("solve nash.toml --out solved.toml").exits(0).stdout;
    assert!(text.contains("solved"), "{text}");
    folder.run("check solved.toml").exits(0);
    folder.run("convert solved.toml solved.csv").exits(0);
    let csv = std::fs::read_to_string(folder.path("solved.csv")).unwrap();
    assert!(csv.starts_with("variable,name,x,F\n0,q1,36.93251"), "{csv}");
    assert!(csv.contains("\n5,p,18.30058"), "{csv}");
}

#[test]
fn info_says_what_is_known_of_f() {
    let folder = folder();
    let text = folder.run("info nash.toml").exits(0).stdout;
    for said in [
        "bounds     6 with a lower bound\n",
        "F          expressions with exact derivatives, ",
        "affine: 0 of 6 rows\n",
        "Jacobian   16 entries, 2 to 6 a row, 6 on the diagonal\n",
        "start      natural residual ",
        "monotone   not monotone: a pair of points shows it\n",
        "P0         no: a pair of points shows it\n",
    ] {
        assert!(text.contains(said), "{said}: {text}");
    }
    let line = folder.run("info nash.toml --json").exits(0).json().remove(0);
    has_keys(
        &line,
        "file kind rows unknowns jacobian_entries title description bounds/lower bounds/upper bounds/both \
         bounds/free bounds/fixed source operations affine_rows jacobian/entries jacobian/entries_per_row/min \
         jacobian/entries_per_row/max jacobian/diagonal residual_at_start affine monotone p0 \
         sampled/pairs sampled/undefined sampled/not_monotone/x sampled/not_monotone/y sampled/not_p0/x sampled/not_p0/y solution",
    );
    assert_eq!(
        (&line["rows"], &line["monotone"], &line["p0"]),
        (&6.into(), &false.into(), &false.into())
    );
    let text = folder.run("info affine.toml").exits(0).stdout;
    for said in [
        "bounds     1 with a lower bound, 1 between two bounds\n",
        "affine: 2 of 2 rows\n",
        "affine     F(x) = M x + q\n",
        "M          2 x 2, sparse, 4 nonzeros",
        "positive semidefinite",
    ] {
        assert!(text.contains(said), "{said}: {text}");
    }
    let line = folder.run("info affine.toml --json").exits(0).json().remove(0);
    assert_eq!((&line["monotone"], &line["p0"]), (&true.into(), &true.into()));
    let text = folder.run("info nowhere.toml").exits(0).stdout;
    assert!(text.contains("start      F is not defined there\n"), "{text}");
    assert!(text.contains("unknown: F is defined at no sampled pair of points\n"), "{text}");
}

#[test]
fn a_jacobian_is_compared_with_differences() {
    let folder = folder();
    let text = folder.run("check nash.toml --jacobian").exits(0).stdout;
    assert!(text.contains("the Jacobian agrees with differences of F\n"), "{text}");
    assert!(text.contains("start      16 entries compared; worst dF["), "{text}");
    assert!(text.contains("solution   16 entries compared; worst dF["), "{text}");
    // At the kink the slope of one side is stated.
    let text = folder.run("check kink.toml --jacobian").exits(1).stdout;
    assert!(text.contains("1 wrong; worst dF[0]/dx[0] = 1.0, by differences 0.0\n"), "{text}");
    let line = folder.run("check kink.toml --jacobian --json").exits(1).json().remove(0);
    has_keys(
        &line,
        "file kind rows unknowns jacobian_entries status message jacobian/start/compared jacobian/start/undefined \
         jacobian/start/wrong jacobian/start/worst/row jacobian/start/worst/column jacobian/start/worst/stated \
         jacobian/start/worst/difference jacobian/start/worst/in_pattern jacobian/start/worst/excess",
    );
    let text = folder.run("check nowhere.toml --jacobian").exits(1).stdout;
    assert!(text.contains("not defined where it is asked for\n"), "{text}");
    folder.run("gen lcp --out lcp.toml").exits(0);
    folder.run("check lcp.toml --jacobian").refused(&[
        "lcp.toml",
        "--jacobian",
        "mcp",
        "found lcp",
    ]);
}

#[test]
fn families_are_made_drawn_and_read_again() {
    let folder = folder();
    for made in [
        "harker_pang --set n=12",
        "nash_cournot --set firms=30 --set idle=0.3",
        "ncp_classic --set name=billups",
        "ncp_classic --set name=josephy",
    ] {
        folder.run(&format!("gen {made} --out made.toml")).exits(0);
        folder.run("check made.toml --tol 1e-12").exits(0);
        folder.run("check made.toml --jacobian").exits(0);
        folder.run("draw made.toml --out made.svg").exits(0);
        let svg = std::fs::read_to_string(folder.path("made.svg")).unwrap();
        assert!(svg.contains("Jacobian of F: "), "{svg}");
    }
    let text = folder.run("gen bratu --set m=12 --out bratu.toml").exits(0).stdout;
    assert!(
        text.contains("mcp, 144 variables, 0 free, 144 between two bounds, 672 entries"),
        "{text}"
    );
    folder.run("solve bratu.toml").exits(0);
    for (setting, said) in [
        ("nash_cournot --set firms=1", "firms: expected from 2 to 200000, found 1"),
        ("nash_cournot --set elasticity=1", "elasticity: expected a number above 1"),
        ("bratu --set lambda=-1", "lambda: expected a number of at least 0, found -1"),
        ("ncp_classic --set name=kojima", "kojima_shindo"),
    ] {
        folder.run(&format!("gen {setting} --out no.toml")).refused(&[said]);
    }
}

/// The own residual speaks of a row, by the name of its variable.
#[test]
fn rows_are_told_by_their_names() {
    let folder = folder();
    let text = "kind = 'mcp'\nnames = ['q', 'p']\nF = ['q', 'sqrt(p^2) + 1 - p']\nlower = [0, -inf]\nstart = [0, 0]\n[solution]\nx = [0, 1e14]\n";
    std::fs::write(folder.path("away.toml"), text).unwrap();
    let text = folder.run("check away.toml").exits(1).stdout;
    assert!(text.contains("(row 1 `p`, limit 1e-4)"), "{text}");
    assert!(!text.contains("(contact"), "{text}");
    std::fs::write(folder.path("far.toml"), text_of_no_solution()).unwrap();
    let text = folder.run("solve far.toml --max-iter 50").exits(1).stdout;
    assert!(text.contains("worst      rows 1 `p` ("), "{text}");
    let nameless = text_of_no_solution().replace("names = ['q', 'p']\n", "").replace("(p)", "(x2)");
    std::fs::write(folder.path("far.toml"), nameless).unwrap();
    let text = folder.run("solve far.toml --max-iter 50").exits(1).stdout;
    assert!(text.contains("worst      rows 1 ("), "{text}");
}

fn text_of_no_solution() -> String {
    "kind = 'mcp'\nnames = ['q', 'p']\nF = ['1', 'exp(p) - (p)']\nlower = [0, -inf]\n".into()
}

#[test]
fn variational_inequalities_go_through_all_commands() {
    let folder = folder();
    for (made, size) in [
        ("traffic --set m=3 --set streams=2", "vi, 48 variables in a polyhedron"),
        ("balls_and_cones", "vi, 15 variables in 2 balls x 3 second-order cones"),
    ] {
        let text = folder.run(&format!("gen {made} --out made.toml")).exits(0).stdout;
        assert!(text.contains(size), "{text}");
        folder.run("check made.toml --tol 1e-12").exits(0);
        folder.run("check made.toml --jacobian").exits(0);
        let text = folder.run("info made.toml").exits(0).stdout;
        assert!(text.contains("\n  set        "), "{text}");
        assert!(text.contains("solution   stored, passes at 1e-8\n"), "{text}");
        folder.run("draw made.toml --out made.svg").exits(0);
        let svg = std::fs::read_to_string(folder.path("made.svg")).unwrap();
        assert!(svg.contains("Jacobian of F: "), "{svg}");
        let text = folder.run("solve made.toml --tol 1e-10 --out solved.toml").exits(0).stdout;
        assert!(text.contains("  constraints "), "{text}");
        folder.run("check solved.toml --tol 1e-10").exits(0);
        folder.run("solve made.toml --solver hyperplane --tol 1e-6").exits(0);
        folder.run("solve made.toml --out solved.csv").exits(0);
        let table = std::fs::read_to_string(folder.path("solved.csv")).unwrap();
        assert!(table.lines().next().unwrap().ends_with(",x,F"), "{table}");
    }
    let line = folder.run("info made.toml --json").exits(0).json().remove(0);
    has_keys(&line, "file kind rows unknowns jacobian_entries parts_of_the_set set");
    assert_eq!(line["set"][2]["sort"], "second_order_cone");
    let line = folder.run("solve made.toml --json").exits(0).json().remove(0);
    has_keys(&line, "constraints_by_status/inside constraints_by_status/border worst_variables");
    // Projections need no multipliers, and multipliers no ball.
    folder
        .run("solve made.toml --solver multipliers/path")
        .refused(&["boxes and polyhedra", "on trial"]);
    let text = folder.run("bench run made.toml --solver auto --solver extragradient --solver hyperplane --out runs.jsonl").exits(0).stdout;
    assert!(text.contains(" runs done"), "{text}");
    let text = folder.run("list auto fixed_point extragradient hyperplane multipliers").stdout;
    let (_, own) = text.split_once("# Variational inequalities\n").unwrap();
    for name in ["auto", "fixed_point", "extragradient", "hyperplane", "multipliers/SOLVER"] {
        assert!(
            own.contains(&format!("{name}: ")) || own.contains(&format!("{name} (the default): ")),
            "{name}: {own}"
        );
    }
    folder.run("solve made.toml --multistart 3").refused(&["--multistart", "found vi"]);
    folder.run("gen ncp_classic --set name=josephy --out josephy.toml").exits(0);
    folder
        .run("solve josephy.toml --multistart 0")
        .refused(&["--multistart: expected at least 1 start, found 0"]);
}

#[test]
fn a_variational_inequality_over_boxes_and_polyhedra_is_an_mcp() {
    let folder = folder();
    let boxed = "kind = 'vi'\nnames = ['a', 'b']\nF = ['a + b - 1', 'b - a^3 - 2']\nset = { box = { upper = [2, 5] } }\n";
    std::fs::write(folder.path("boxed.toml"), boxed).unwrap();
    let text = folder.run("info boxed.toml").exits(0).stdout;
    assert!(text.contains("over a box it is a mixed complementarity problem (mcp)\n"), "{text}");
    folder.run("solve boxed.toml --out solved.toml").exits(0);
    let text = folder.run("convert solved.toml boxed.nl").exits(0).stdout;
    assert!(
        text.contains("as         mcp, as the variational inequality over a box is one\n"),
        "{text}"
    );
    folder.run("solve boxed.nl").exits(0);
    folder.run("convert solved.toml mcp.toml --as-mcp").exits(0);
    let text = folder.run("check mcp.toml").exits(0).stdout;
    assert!(text.contains("mcp, 2 variables, 0 free, 2 between two bounds"), "{text}");
    folder.run("gen traffic --set m=2 --set streams=1 --out traffic.toml").exits(0);
    let text = folder.run("convert traffic.toml traffic.nl").exits(0).stdout;
    assert!(
        text.contains("mcp, with 3 multipliers as variables behind x; without the solution"),
        "{text}"
    );
    folder.run("solve traffic.nl").exits(0);
    folder.run("gen balls_and_cones --out cones.toml").exits(0);
    folder.run("convert cones.toml cones.nl").refused(&["cones.nl", "vi"]);
    folder.run("convert cones.toml mcp.toml --as-mcp").refused(&["--as-mcp", "found vi"]);
    folder.run("convert boxed.nl mcp.toml --as-mcp").refused(&["--as-mcp", "found mcp"]);
}

/// Whatever start a problem has, and however far x runs, a point is solved only where it is a solution.
#[test]
fn neither_a_start_far_off_nor_a_large_x_makes_a_point_a_solution() {
    let folder = Folder::new();
    let put = |name: &str, text: &str| std::fs::write(folder.path(name), text).unwrap();
    let mcps = [
        // ln 2, from where F is 1e21.
        ("exp", "F = ['exp(x1) - 2']\nstart = [50]\n", Some(std::f64::consts::LN_2)),
        ("square", "F = ['(x1 - 1)^2 - 1.01']\nstart = [1e9]\n", Some(2.004_987_562_112_089)),
        (
            "none",
            "F = ['exp(x1) - 2*x2 - 1', 'x2 - x1 + 0.5']\nlower = [-inf, -inf]\nstart = [30, 0]\n",
            None,
        ),
        ("sum", "F = ['exp(x1) - exp(x2) - 1', 'exp(x2) - exp(x1) - 1']\nstart = [30, 30]\n", None),
    ];
    for (name, text, solution) in mcps {
        put("mcp.toml", &format!("kind = 'mcp'\n{text}"));
        for solver in ["auto", "path", "semismooth", "newton_fb"] {
            let command =
                format!("solve mcp.toml --solver {solver} --time-limit 5 --json --solution");
            let line = folder.run(&command).json().remove(0);
            match (line["status"] == "solved", solution) {
                (true, Some(x)) => {
                    let found = line["solution"]["x"][0].as_f64().unwrap();
                    assert!((found - x).abs() < 1e-6, "{name} by {solver}: {found}");
                }
                (true, None) => panic!("{name} by {solver}: {line}"),
                (false, _) => {}
            }
        }
    }
    let affine = "kind = 'mcp'\nF = ['x1 - 3', 'x2 - x1']\nlower = [-inf, -inf]\nstart = [1e13, 0]\nsolution = { x = [0, 0] }\n";
    put("affine.toml", affine);
    folder.run("check affine.toml").exits(1);
    for (name, text) in [
        (
            "cone",
            "F = ['x1 - x1 - 3', '2']\n[[set]]\nfrom = 'x1'\nto = 'x1'\nsecond_order_cone = {}\n[[set]]\nfrom = 'x2'\nto = 'x2'\nbox = {}\n",
        ),
        (
            "ball",
            "F = ['x1 - x2 - 1', '-x1']\n[[set]]\nfrom = 'x1'\nto = 'x1'\nball = { centre = [2.5], radius = 1.5 }\n[[set]]\nfrom = 'x2'\nto = 'x2'\nbox = {}\n",
        ),
        (
            "box",
            "F = ['x1 - x2 - 1', '-x1']\nset = { box = { lower = [1, -inf], upper = [4, inf] } }\n",
        ),
        (
            "scale",
            "F = ['1e10*x1 - 1e10', '0*x1 - 3']\nstart = [1, 0]\n[[set]]\nfrom = 'x1'\nto = 'x1'\nball = { centre = [0], radius = 5 }\n[[set]]\nfrom = 'x2'\nto = 'x2'\nbox = {}\n",
        ),
    ] {
        put("vi.toml", &format!("kind = 'vi'\n{text}"));
        for solver in ["auto", "hyperplane", "extragradient", "fixed_point"] {
            let command =
                format!("solve vi.toml --solver {solver} --time-limit 3 --json --solution");
            let line = folder.run(&command).json().remove(0);
            assert!(line["status"] != "solved", "{name} by {solver}: {line}");
        }
    }
}

/// Steps that grow without a bound could not be shortened again: neither limit was ever looked at.
#[test]
fn a_projection_method_that_runs_away_ends_at_its_limit() {
    let folder = Folder::new();
    let text = "kind = 'vi'\nF = ['11 - 3*x3^2', '-2*(x3 + 2)^2 - x1 + 1', '1 - x1']\nstart = [-3, 1, 0]\nset = { box = { lower = [-1, -inf, -4], upper = [1, inf, inf] } }\n";
    std::fs::write(folder.path("vi.toml"), text).unwrap();
    folder.run("solve vi.toml --solver hyperplane --time-limit 0.5").exits(1);
}
