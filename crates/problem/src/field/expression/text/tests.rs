use super::*;

fn parse(text: &str) -> Result<Expressions, ProblemError> {
    Expressions::parse(&[text.into()], &[])
}

fn at(text: &str, x: f64) -> f64 {
    let mut f = [0.0];
    parse(text).unwrap().evaluator().value(&[x], &mut f);
    f[0]
}

#[test]
fn operators_bind_as_in_books() {
    for (text, expected) in [
        ("1 + 2*3^2", 19.0),
        ("2^3^2", 512.0),
        ("-3^2", -9.0),
        ("(-3)^2", 9.0),
        ("2^-1*4", 2.0),
        ("8/4/2", 1.0),
        ("8 - 4 - 2", 2.0),
        ("2 * - 3", -6.0),
        ("+x1 - +1", 4.0),
        ("- -x1", 5.0),
        ("1 + 1 == 2 && !(3 < 2) || 0", 1.0),
        ("!x1 == 0", 1.0),
        ("if(x1 > 4, 1.5e1, .5)", 15.0),
        ("max(1, x1, 3.) - min(x1,2)", 3.0),
        ("sum(1, 2, x1)", 8.0),
        ("less(x1, 3) + atan2(0, 1)", 2.0),
        ("2*pi - 2*pi + ln(e)", 1.0),
        ("mod(-x1, 3) + div(x1, 2)", 0.0),
        ("piecewise(x1, -1, 0, 1, 3, 2)", 7.0),
        ("numberof(x1, 5, 3, 5) + count(x1, 0)", 3.0),
        ("1e+2 + 1E-2*0", 100.0),
    ] {
        assert_eq!(at(text, 5.0), expected, "{text}");
    }
    assert!(
        Expressions::parse(&["e".into(), "pi".into()], &["pi".into(), "e".into()])
            .is_ok_and(|f| f.affine().is_some_and(|a| a.entries == [(0, 1, 1.0), (1, 0, 1.0)]))
    );
}

#[test]
fn errors_name_row_column_expected_and_found() {
    for (text, expected) in [
        ("", "F[0], column 1: expected a number, a name, a function or `(`, found the end"),
        ("x1 + ", "F[0], column 6: expected a number, a name, a function or `(`, found the end"),
        ("x1 x1", "F[0], column 4: expected an operator or the end, found `x1`"),
        ("2x1", "F[0], column 2: expected an operator or the end, found `x1`"),
        ("(x1, 2)", "F[0], column 4: expected an operator or `)`, found `,`"),
        ("max(x1 2)", "F[0], column 8: expected an operator, `,` or `)`, found `2`"),
        ("x1)", "F[0], column 3: expected an operator or the end, found `)`"),
        ("é + y", "F[0], column 1: expected a variable (x1), found `é`"),
        ("x1 + ý", "F[0], column 6: expected a variable (x1), found `ý`"),
        (
            "x1 & x1",
            "F[0], column 4: expected a number, a name, an operator or a parenthesis, found `&`",
        ),
        (
            "1 < x1 < 2",
            "F[0], column 8: expected parentheses around one of two comparisons, found `<`",
        ),
        ("log(x1, 2)", "F[0], column 1: expected one argument of `log`, found 2"),
        ("1e999", "F[0], column 1: expected a finite number, found `1e999`"),
        (".", "F[0], column 1: expected a finite number, found `.`"),
        ("x[1", "F[0], column 2: expected a `]` that closes this, found none"),
        ("`x", "F[0], column 1: expected a second ` that closes this, found none"),
        (
            "piecewise(x1, 1, 2)",
            "F[0], column 1: expected x, a slope, and a point and a slope each of `piecewise`, found 3",
        ),
        (
            "piecewise(x1, x1)",
            "F[0], column 1: expected slopes with ascending points between them, found expected numbers",
        ),
    ] {
        let said = parse(text).unwrap_err().to_string();
        assert!(said.starts_with(expected), "{text}: {said}");
    }
    let said = parse("f(x1)").unwrap_err().to_string();
    assert!(
        said.starts_with("F[0], column 1: expected a function (abs, ")
            && said.ends_with("found `f`"),
        "{said}"
    );
    let names = |names: &[&str]| {
        let names: Vec<_> = names.iter().map(|n| n.to_string()).collect();
        Expressions::parse(&["1".into(), "2".into()], &names).unwrap_err().to_string()
    };
    assert_eq!(names(&["a", "a"]), "names[1]: expected a name of its own, found `a`, as names[0]");
    assert_eq!(names(&["a", ""]), "names[1]: expected a name, found none");
    assert_eq!(names(&["a"]), "F: expected 1 expressions, as there are as many names, found 2");
}

#[test]
fn names_are_written_so_that_they_are_read() {
    let names =
        ["q[1,a]", "b.x[2].y", "two words", "a`b", "exp", "größe", "3d", "x["].map(String::from);
    let texts = names.each_ref().map(|name| format!("2*{} + exp(1)", written(name)));
    assert_eq!(texts[0], "2*q[1,a] + exp(1)");
    assert_eq!(texts[3], "2*`a``b` + exp(1)");
    let f = Expressions::parse(&texts, &names).unwrap();
    assert_eq!(f.texts(&names).unwrap(), texts);
    assert!(f.affine().is_some_and(|a| a.entries.iter().all(|&(i, j, c)| i == j && c == 2.0)));
}

#[test]
fn what_is_written_twice_is_one_node() {
    let texts = ["exp(x1*x2) + x1", "2 - exp(x1*x2)"].map(String::from);
    let f = Expressions::parse(&texts, &[]).unwrap();
    // x1, x2, x1*x2, exp, +, 2, −
    assert_eq!(f.graph().nodes().len(), 7);
    assert_eq!(f.texts(&[]).unwrap(), texts);
}

#[test]
fn deep_texts_are_no_recursion() {
    let deep = 300_000;
    let text = format!("{}x1{}", "-(1+".repeat(deep), ")".repeat(deep));
    let f = parse(&text).unwrap();
    let again = f.texts(&[]).unwrap();
    assert!(Expressions::parse(&again, &[]).unwrap().same(&f));
    assert!(parse(&"(".repeat(deep)).is_err());
    assert!(parse(&"x1^".repeat(deep)).is_err());
}

#[test]
fn parts_shared_too_often_are_not_written() {
    let mut g = Graph::new(1);
    let x = g.variable(0);
    let row = (0..60).fold(x, |a, _| g.binary(Binary::Mul, a, a));
    let f = Expressions::new(g, vec![row]).unwrap();
    let said = f.texts(&[]).unwrap_err().to_string();
    assert!(said.starts_with("F[0]: expected at most 64 MiB of text"), "{said}");
}

/// Pseudorandom numbers below a bound.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % bound
    }

    fn number(&mut self) -> f64 {
        let scale = [1.0, 0.1, 1e-3, 1e5, -1.0, -7.3][self.below(6)];
        self.below(10) as f64 * scale
    }
}

/// A graph of random nodes of every type.
fn random_graph(random: &mut Random, n: usize) -> Expressions {
    let mut unary: Vec<_> = UNARY.iter().map(|of| of.1).collect();
    unary.extend([Unary::Neg, Unary::Square, Unary::Not, Unary::Neg]);
    let mut binary: Vec<_> = INFIX.iter().map(|of| of.1).collect();
    binary.extend(BINARY.iter().map(|of| of.1));
    binary.extend([Binary::Add, Binary::Sub, Binary::Mul, Binary::Div, Binary::Pow]);
    let mut g = Graph::new(n);
    let mut all: Vec<_> = (0..n).map(|i| g.variable(i)).collect();
    for x in [2.0, -2.0, 0.5, -0.0] {
        all.push(g.constant(x));
    }
    for _ in 0..12 {
        // Mostly of the latest, that there be depth.
        let any = |random: &mut Random, all: &[Id]| {
            let reach = if random.below(2) == 0 { all.len() } else { 4 };
            all[all.len() - 1 - random.below(reach)]
        };
        let node = match random.below(9) {
            0 => Node::Constant(random.number()),
            1 | 2 => Node::Unary(unary[random.below(unary.len())], any(random, &all)),
            3..=5 => {
                let op = binary[random.below(binary.len())];
                Node::Binary(op, any(random, &all), any(random, &all))
            }
            6 => {
                let count = random.below(4);
                let op = NARY[random.below(NARY.len())].1;
                Node::Nary(op, (0..count).map(|_| any(random, &all)).collect())
            }
            7 => {
                let count = random.below(4);
                Node::Linear((0..count).map(|_| (random.below(n), random.number())).collect())
            }
            _ if random.below(2) == 0 => Node::If([(); 3].map(|()| any(random, &all))),
            _ => {
                let slopes = vec![random.number(), random.number(), random.number()];
                let mut breaks = vec![random.number(), random.number()];
                breaks.sort_by(f64::total_cmp);
                Node::Piecewise(Piecewise::new(slopes, breaks).unwrap(), any(random, &all))
            }
        };
        all.push(g.add(node));
    }
    let rows = all[all.len() - n..].to_vec();
    Expressions::new(g, rows).unwrap()
}

/// The values, and the dense Jacobian where it is defined.
fn look(f: &Expressions, x: &[f64]) -> (Vec<f64>, Option<Vec<f64>>) {
    let n = x.len();
    let mut run = f.evaluator();
    let (mut value, mut jacobian) = (vec![0.0; n], vec![0.0; f.pattern().len()]);
    run.value(x, &mut value);
    let defined = run.jacobian(x, &mut vec![0.0; n], &mut jacobian);
    let mut dense = vec![0.0; n * n];
    f.pattern().places().zip(&jacobian).for_each(|((i, j), a)| dense[i * n + j] = *a);
    (value, defined.then_some(dense))
}

#[test]
fn random_graphs_are_written_and_read_with_the_same_values_and_jacobians() {
    let mut random = Random(3);
    let (mut compared, mut slopes) = (0, 0);
    for _ in 0..4000 {
        let n = 1 + random.below(4);
        let f = random_graph(&mut random, n);
        let texts = f.texts(&[]).unwrap();
        let read = Expressions::parse(&texts, &[]).unwrap();
        let again = read.texts(&[]).unwrap();
        assert!(Expressions::parse(&again, &[]).unwrap().same(&read), "{texts:?} {again:?}");
        for _ in 0..4 {
            let x: Vec<f64> = (0..n).map(|_| random.below(1000) as f64 / 300.0 - 1.0).collect();
            let ((a, ja), (b, jb)) = (look(&f, &x), look(&read, &x));
            for (a, b) in a.iter().zip(&b) {
                assert!(
                    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
                    "{a} {b} {x:?} {texts:?}"
                );
                compared += usize::from(a.is_finite() && *a != 0.0);
            }
            // Sums of slopes are in another order where other parts are shared.
            if let (Some(a), Some(b)) = (ja, jb) {
                let size = a.iter().fold(1.0, |m: f64, a| m.max(a.abs()));
                for (a, b) in a.iter().zip(&b) {
                    assert!((a - b).abs() <= 1e-9 * size, "{a} {b} {x:?} {texts:?}");
                    slopes += usize::from(*a != 0.0);
                }
            }
        }
    }
    assert!(compared > 10_000 && slopes > 5_000, "{compared} {slopes}");
}

proptest::proptest! {
    #[test]
    fn any_text_is_read_or_refused_on_one_line(text in "[x1-3`()\\[\\]. ^*/+<=!&|,a-ep\u{e9}-]{0,40}") {
        if let Err(e) = parse(&text) {
            let said = e.to_string();
            proptest::prop_assert!(said.starts_with("F[0], column ") && !said.contains('\n'), "{}", said);
        }
    }
}
