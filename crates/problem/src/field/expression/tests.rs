use super::*;

/// Pseudorandom numbers in [lo, hi].
struct Random(u64);

impl Random {
    fn next(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        lo + (hi - lo) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// Expressions that use every smooth operation, with parts that rows share.
fn zoo() -> Expressions {
    let mut g = Graph::new(4);
    let x: Vec<_> = (0..4).map(|i| g.variable(i)).collect();
    let two = g.constant(2.0);
    let three = g.constant(3.0);
    let half = g.constant(0.7);
    let shared = g.binary(Binary::Mul, x[0], x[1]);
    let e = g.unary(Unary::Exp, shared);
    let deep = g.binary(Binary::Add, e, x[2]);
    let unary = [
        Unary::Sqrt,
        Unary::Square,
        Unary::Log,
        Unary::Log10,
        Unary::Sin,
        Unary::Cos,
        Unary::Tan,
        Unary::Atan,
        Unary::Sinh,
        Unary::Cosh,
        Unary::Tanh,
        Unary::Asinh,
        Unary::Logistic,
        Unary::Neg,
    ];
    // The tangent away from its poles.
    let of = |op| if op == Unary::Tan { shared } else { deep };
    let all: Vec<_> = unary.map(|op| g.unary(op, of(op))).into();
    let r0 = g.sum(all);
    let small = g.binary(Binary::Div, x[3], three);
    let p = [Unary::Asin, Unary::Acos, Unary::Atanh].map(|op| g.unary(op, small));
    let c = g.unary(Unary::Cosh, x[3]);
    let acosh = g.unary(Unary::Acosh, c);
    let r1 = g.sum(vec![p[0], p[1], p[2], acosh, deep]);
    let pows = [
        g.binary(Binary::Pow, x[0], three),
        g.binary(Binary::Pow, x[1], half),
        g.binary(Binary::Pow, x[2], x[3]),
        g.binary(Binary::SignPow, x[0], three),
        g.binary(Binary::Atan2, x[0], x[2]),
        g.binary(Binary::Less, x[0], x[3]),
        g.binary(Binary::Sub, x[0], shared),
        g.binary(Binary::Rem, x[2], two),
    ];
    let r2 = g.sum(pows.into());
    let larger = g.add(Node::Nary(Nary::Max, vec![x[0], x[1], x[2]]));
    let smaller = g.add(Node::Nary(Nary::Min, vec![shared, x[3]]));
    let linear = g.add(Node::Linear(vec![(0, 2.0), (3, -1.5)]));
    let piece = Piecewise::new(vec![-1.0, 2.0, 5.0], vec![-0.5, 0.25]).unwrap();
    let pl = g.add(Node::Piecewise(piece, x[1]));
    let condition = g.binary(Binary::Gt, x[0], x[1]);
    let either = g.add(Node::If([condition, e, linear]));
    let r3 = g.sum(vec![larger, smaller, linear, pl, either, shared]);
    Expressions::new(g, vec![r0, r1, r2, r3]).unwrap()
}

#[test]
fn jacobians_agree_with_finite_differences() {
    let f = zoo();
    let mut run = f.evaluator();
    let mut random = Random(7);
    for _ in 0..200 {
        let x: Vec<f64> = (0..4).map(|_| random.next(0.3, 0.9)).collect();
        let (mut value, mut jacobian) = (vec![0.0; 4], vec![0.0; f.pattern().len()]);
        assert!(run.jacobian(&x, &mut value, &mut jacobian));
        let mut dense = [[0.0; 4]; 4];
        f.pattern().places().zip(&jacobian).for_each(|((i, j), v)| dense[i][j] = *v);
        for j in 0..4 {
            let h = 1e-6;
            let at = |t: f64, run: &mut dyn Evaluator| {
                let mut y = x.clone();
                y[j] += t;
                let mut f = vec![0.0; 4];
                assert!(run.value(&y, &mut f));
                f
            };
            let (up, down) = (at(h, &mut *run), at(-h, &mut *run));
            // At a kink the two sides differ.
            let kink = (at(10.0 * h, &mut *run)[3] - at(-10.0 * h, &mut *run)[3]) / (20.0 * h);
            for i in 0..4 {
                let slope = (up[i] - down[i]) / (2.0 * h);
                if i == 3 && (slope - kink).abs() > 1e-3 {
                    continue;
                }
                assert!((slope - dense[i][j]).abs() <= 1e-6 * (1.0 + slope.abs()), "{i} {j} {x:?}");
            }
        }
    }
}

#[test]
fn doubled_precision_sees_what_cancels() {
    // (1e16 + x) − 1e16 − x
    let mut g = Graph::new(1);
    let (x, c) = (g.variable(0), g.constant(1e16));
    let a = g.binary(Binary::Add, c, x);
    let b = g.binary(Binary::Sub, a, c);
    let square = g.binary(Binary::Mul, b, b);
    let root = g.unary(Unary::Sqrt, square);
    let f = Expressions::new(g, vec![root]).unwrap();
    let (mut run, mut plain, mut precise) = (f.evaluator(), [0.0], [0.0]);
    assert!(run.value(&[0.3], &mut plain) && run.precisely(&[0.3], &mut precise));
    assert_eq!((plain[0], precise[0]), (0.0, 0.3));
}

#[test]
fn sizes_are_those_of_monomials_whatever_the_scale() {
    // s (1 − x)^4 with x = y/t: (1 + |x|)^4 s.
    for (s, t) in [(1.0, 1.0), (1024.0, 0.25)] {
        let mut g = Graph::new(1);
        let y = g.variable(0);
        let t_inverse = g.constant(1.0 / t);
        let x = g.binary(Binary::Mul, t_inverse, y);
        let (one, four, scale) = (g.constant(1.0), g.constant(4.0), g.constant(s));
        let d = g.binary(Binary::Sub, one, x);
        let p = g.binary(Binary::Pow, d, four);
        let row = g.binary(Binary::Mul, scale, p);
        let f = Expressions::new(g, vec![row]).unwrap();
        let mut size = [0.0];
        assert!(f.evaluator().sizes(&[-2.0 * t], &mut size));
        assert_eq!(size[0], 81.0 * s);
    }
}

#[test]
fn undefined_values_are_said() {
    let mut g = Graph::new(1);
    let x = g.variable(0);
    let row = g.unary(Unary::Log, x);
    let f = Expressions::new(g, vec![row]).unwrap();
    let mut run = f.evaluator();
    assert!(!run.value(&[-1.0], &mut [0.0]) && !run.value(&[0.0], &mut [0.0]));
    assert!(run.value(&[1.0], &mut [0.0]));
}

/// What has no value has none either where a comparison, a power or an operation that forgets its argument is made of it.
#[test]
fn what_is_undefined_stays_so() {
    for (text, x) in [
        ("1 + less(sqrt(x), 2)", -2.0),
        ("1 - less(exp(x), 2*x)", 1000.0),
        ("if(sqrt(x) > 2, -1, 1)", -2.0),
        ("1 + (log(x) > 2)", -2.0),
        ("1 + (2 == sqrt(x))", -2.0),
        ("1 + !sqrt(x)", -2.0),
        ("1 + (sqrt(x) && 1)", -2.0),
        ("1 + (0 || sqrt(x))", -2.0),
        ("1 + sqrt(x)^0", -2.0),
        ("1^sqrt(x)", -2.0),
        ("1 + exp(log(x))", 0.0),
        ("max(log(x), x)", 0.0),
        ("atan(x^(-0.5))", 0.0),
        ("min(1, x^(0 - x - 0.5))", 0.0),
        ("min(1, signpow(x, -1))", 0.0),
        ("exp(-div(1, x))", 0.0),
        ("tanh(atanh(x/4))", 4.0),
        ("1/atanh(x/4)", -4.0),
    ] {
        let field = Expressions::parse(&[text.into()], &["x".into()]).unwrap();
        let mut run = field.evaluator();
        assert!(!run.value(&[x], &mut [0.0]), "{text}");
        assert!(!run.precisely(&[x], &mut [0.0]), "{text}, precisely");
        assert!(run.value(&[3.0], &mut [0.0]), "{text} at 3");
    }
    // What is not asked need not have a value.
    for (text, value) in [("(0 && sqrt(x)) + 1", 1.0), ("(1 || sqrt(x)) + 1", 2.0)] {
        let field = Expressions::parse(&[text.into()], &["x".into()]).unwrap();
        let mut f = [0.0];
        assert!(field.evaluator().value(&[-2.0], &mut f) && f == [value], "{text}");
    }
}

#[test]
fn affine_rows_have_their_coefficients() {
    let mut g = Graph::new(2);
    let (x, y) = (g.variable(0), g.variable(1));
    let (two, three, tenth) = (g.constant(2.0), g.constant(3.0), g.constant(0.1));
    let a = g.binary(Binary::Mul, two, x);
    let b = g.binary(Binary::Div, y, two);
    let minus = g.unary(Unary::Neg, b);
    let r0 = g.sum(vec![a, minus, three, x]);
    let r1 = g.binary(Binary::Mul, y, three);
    let affine = Expressions::new(g.clone(), vec![r0, r1]).unwrap().affine().unwrap();
    assert!(affine.exact);
    assert_eq!(affine.constants, [3.0, 0.0]);
    assert_eq!(affine.entries, [(0, 0, 3.0), (0, 1, -0.5), (1, 1, 3.0)]);
    let rounded = g.binary(Binary::Mul, r1, tenth);
    let affine = Expressions::new(g.clone(), vec![r0, rounded]).unwrap().affine().unwrap();
    assert!(!affine.exact);
    let square = g.binary(Binary::Mul, x, y);
    let f = Expressions::new(g, vec![r0, square]).unwrap();
    assert_eq!(f.affine_rows(), [true, false]);
    assert!(f.affine().is_none());
}

#[test]
fn piecewise_linear_functions_are_zero_at_zero() {
    let f = Piecewise::new(vec![-1.0, 2.0, 5.0], vec![-1.0, 3.0]).unwrap();
    let at = |x: f64| f.at(x).0;
    assert_eq!([at(0.0), at(2.0), at(4.0), at(-0.5), at(-2.0)], [0.0, 4.0, 11.0, -1.0, -1.0]);
    let g = Piecewise::new(vec![1.0, 3.0], vec![2.0]).unwrap();
    assert_eq!([g.at(-1.0).0, g.at(1.0).0, g.at(3.0).0], [-1.0, 1.0, 5.0]);
    // Breakpoints right of the argument 0 only, and left only.
    let h = Piecewise::new(vec![1.0, 3.0], vec![-2.0]).unwrap();
    assert_eq!([h.at(-3.0).0, h.at(1.0).0], [-7.0, 3.0]);
    assert!(Piecewise::new(vec![1.0], vec![1.0]).is_err());
    assert!(Piecewise::new(vec![1.0, 2.0, 3.0], vec![2.0, 1.0]).is_err());
}

#[test]
fn a_chain_of_a_million_sums_is_no_recursion() {
    let mut g = Graph::new(1);
    let x = g.variable(0);
    let row = (0..1_000_000).fold(x, |sum, _| g.binary(Binary::Add, sum, x));
    let f = Expressions::new(g, vec![row]).unwrap();
    let (mut value, mut jacobian) = ([0.0], [0.0]);
    assert!(f.evaluator().jacobian(&[1.0], &mut value, &mut jacobian));
    assert_eq!((value[0], jacobian[0]), (1_000_001.0, 1_000_001.0));
    assert!(f.affine().is_some());
}

/// `x − 3 z + y − 2 (x − (y − z)) − (x + y)`: sums that come first and multiples are part of a sum, what would be added in another order is not.
#[test]
fn sums_in_sums_are_one_operation() {
    let mut g = Graph::new(3);
    let [x, y, z] = [0, 1, 2].map(|i| g.variable(i));
    let (two, three) = (g.constant(2.0), g.constant(3.0));
    let tripled = g.binary(Binary::Mul, three, z);
    let first = g.binary(Binary::Sub, x, tripled);
    let second = g.binary(Binary::Add, first, y);
    let inner = g.binary(Binary::Sub, y, z);
    let outer = g.binary(Binary::Sub, x, inner);
    let doubled = g.binary(Binary::Mul, two, outer);
    let third = g.binary(Binary::Sub, second, doubled);
    let shared = g.binary(Binary::Add, x, y);
    let row = g.binary(Binary::Sub, third, shared);
    let f = Expressions::new(g, vec![row, x, shared]).unwrap();
    // One sum of x, 3 z, y, 2 outer and shared; shared, inner and outer.
    assert_eq!(f.operations(), (1 + 5) + 3);
    let (mut value, mut jacobian) = ([0.0; 3], [0.0; 6]);
    assert!(f.evaluator().jacobian(&[1.0, 10.0, 100.0], &mut value, &mut jacobian));
    assert_eq!(value, [-482.0, 1.0, 11.0]);
    assert_eq!(jacobian, [-2.0, 2.0, -5.0, 1.0, 1.0, 1.0]);
}
