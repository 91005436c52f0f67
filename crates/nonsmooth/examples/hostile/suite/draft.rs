//! What hostile problems are made of: small whole numbers, perturbed by powers of two, scaled by powers of two, with rows that
//! repeat, vanish or contradict each other. All entries are exact, so that what is planted is true of the data as stored.

/// A generator of random numbers: SplitMix64.
#[derive(Debug, Clone)]
pub struct Rng(u64);

impl Rng {
    /// The generator of one problem: the same for ever.
    pub fn of(seed: u64, kind: u64, index: u64) -> Self {
        let mut rng = Self(seed ^ 0x9e37_79b9_7f4a_7c15);
        for x in [kind, index] {
            rng.0 = rng.next() ^ x.wrapping_mul(0xd134_2543_de82_ef95);
        }
        rng
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Below n.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// From a to b, both included.
    pub fn int(&mut self, a: i32, b: i32) -> i32 {
        a + self.below((b - a + 1) as usize) as i32
    }

    pub fn whole(&mut self, a: i32, b: i32) -> f64 {
        f64::from(self.int(a, b))
    }

    /// In [−1, 1).
    pub fn real(&mut self) -> f64 {
        (self.next() >> 11) as f64 * 2.0_f64.powi(-52) - 1.0
    }

    pub fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

pub type Rows = Vec<Vec<f64>>;

/// What is known of a problem before anybody solves it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    Solvable,
    Unsolvable,
    Unknown,
}

/// A problem in the making.
#[derive(Debug, Clone)]
pub struct Draft {
    pub rng: Rng,
    /// The smallest relative change that was made to whole numbers on purpose; 1 where none was.
    pub fine: f64,
    /// Contacts are in units of their own, where each is held to the root of the tolerance.
    pub apart: bool,
    /// Only whole numbers so far, small enough that sums of products of them are exact.
    pub exact: bool,
    /// How it was made.
    pub recipe: String,
}

impl Draft {
    pub fn new(rng: Rng) -> Self {
        Self { rng, fine: 1.0, apart: false, exact: true, recipe: String::new() }
    }

    pub fn say(&mut self, what: &str) {
        self.recipe += what;
        self.recipe.push(' ');
    }

    /// The size of a problem that is decided by enumeration.
    pub fn small(&mut self) -> usize {
        match self.rng.below(100) {
            0..60 => 1 + self.rng.below(4),
            60..92 => 5 + self.rng.below(3),
            _ => 8 + self.rng.below(3),
        }
    }

    /// `2^-k`, k = 20 … 52, noted.
    pub fn tiny(&mut self) -> f64 {
        let tiny = 2.0_f64.powi(-self.rng.int(20, 52));
        self.fine = self.fine.min(tiny);
        self.exact = false;
        tiny
    }

    /// Contacts whose free velocities are up to `velocity` where the numbers that decide are of size one; `apart`: in units of their own.
    pub fn beside(&mut self, velocity: f64, apart: bool) {
        self.fine = self.fine.min(1.0 / velocity.max(1.0));
        self.apart |= apart;
    }

    /// Whole numbers, many of them small.
    pub fn ints(&mut self, rows: usize, columns: usize) -> Rows {
        let most = self.rng.pick(&[1, 2, 3, 5, 9]);
        let full = self.rng.pick(&[30, 60, 100, 100]);
        let rng = &mut self.rng;
        let mut entry = || if rng.chance(full) { rng.whole(-most, most) } else { 0.0 };
        (0..rows).map(|_| (0..columns).map(|_| entry()).collect()).collect()
    }

    /// A square matrix of one of many kinds.
    pub fn square(&mut self, n: usize) -> Rows {
        let flavour = self.rng.below(13);
        let mut a = match flavour {
            0 | 1 => self.ints(n, n),
            2 | 3 => {
                let columns = 1 + self.rng.below(n);
                gram(&self.ints(n, columns))
            }
            4 => {
                let columns = 1 + self.rng.below(n);
                let (g, s) = (gram(&self.ints(n, columns)), self.ints(n, n));
                matrix(n, n, |i, j| g[i][j] + s[i][j] - s[j][i])
            }
            5 => {
                let s = self.ints(n, n);
                matrix(n, n, |i, j| s[i][j] - s[j][i])
            }
            6 => {
                let mut a = self.ints(n, n);
                (0..n).for_each(|i| a[i][i] = 0.0);
                a
            }
            7 => {
                // A chain's Laplacian, nearly singular: semidefinite but for its diagonal.
                let tiny = self.tiny();
                let plus = if self.rng.chance(75) { tiny } else { -tiny };
                let (first, last) = (0, n - 1);
                let degree = |i: usize| f64::from(u8::from(i != first) + u8::from(i != last));
                let full = self.rng.chance(50);
                matrix(n, n, |i, j| match (i == j, i.abs_diff(j) == 1) {
                    (true, _) if full => n as f64 - 1.0 + plus,
                    (true, _) => degree(i) + plus,
                    (false, near) if near || full => -1.0,
                    _ => 0.0,
                })
            }
            8 => {
                let mut a = self.ints(n, n);
                for i in 0..n {
                    for j in 0..n {
                        a[i][j] = if i == j { a[i][j].abs() } else { -a[i][j].abs() };
                    }
                }
                a
            }
            9 if n <= 6 => {
                self.exact = false;
                let bits = self.rng.pick(&[10, 52]);
                let coarse = 2.0_f64.powi(bits);
                let rng = &mut self.rng;
                matrix(n, n, |_, _| (rng.real() * coarse).round() / coarse)
            }
            10 => {
                let (b, c) = (self.ints(n, 1), self.ints(n, 1));
                matrix(n, n, |i, j| b[i][0] * c[j][0])
            }
            11 => {
                // Symmetric, of any sign.
                let s = self.ints(n, n);
                matrix(n, n, |i, j| s[i][j] + s[j][i])
            }
            _ => {
                // Near a singular matrix, in one entry.
                let mut a = gram(&self.ints(n, 1 + n / 2));
                let (i, j) = (self.rng.below(n), self.rng.below(n));
                let tiny = self.tiny();
                if self.rng.chance(50) {
                    (0..n).for_each(|i| a[i][i] += tiny);
                } else {
                    a[i][j] += tiny;
                }
                a
            }
        };
        self.say(&format!("M{flavour}"));
        if n > 1 && self.rng.chance(12) {
            self.say("twin");
            let (i, j) = (self.rng.below(n), self.rng.below(n));
            a[i] = a[j].clone();
            a.iter_mut().for_each(|row| row[i] = row[j]);
        }
        if self.rng.chance(6) {
            self.say("zero-row");
            let i = self.rng.below(n);
            a[i].fill(0.0);
        }
        if self.rng.chance(5) {
            self.say("zero-column");
            let j = self.rng.below(n);
            a.iter_mut().for_each(|row| row[j] = 0.0);
        }
        a
    }

    /// Free terms, more of them negative.
    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        let most = self.rng.pick(&[1, 3, 9]);
        let mut q: Vec<_> = (0..n).map(|_| self.rng.whole(-most, most / 2)).collect();
        if self.rng.chance(5) {
            self.say("tiny-q");
            let (i, tiny) = (self.rng.below(n), self.tiny());
            q[i] = if self.rng.chance(50) { -tiny } else { q[i] + tiny };
        }
        q
    }

    /// Exponents of scales of rows or columns: none, mild, wild.
    pub fn exponents(&mut self, n: usize, what: &str) -> Vec<i32> {
        let most = match self.rng.below(100) {
            0..50 => 0,
            50..65 => 10,
            65..98 => 40,
            _ => 200,
        };
        if most > 0 {
            self.say(&format!("{what}{most}"));
        }
        (0..n).map(|_| self.rng.int(-most, most)).collect()
    }

    /// A coefficient of friction.
    pub fn mu(&mut self) -> f64 {
        let tiny = 2.0_f64.powi(-20);
        let mu = self.rng.pick(&[0.0, 0.0, 0.25, 0.5, 0.5, 0.625, 1.0, 2.0, 3.0, 1e3, 1e6, tiny]);
        if mu == tiny {
            // A coarse tolerance does not tell it from none.
            self.fine = self.fine.min(tiny);
        }
        mu
    }

    /// Coefficients for contacts; often all the same.
    pub fn mus(&mut self, nc: usize) -> Vec<f64> {
        let mu = self.mu();
        let same = self.rng.chance(50);
        (0..nc).map(|_| if same { mu } else { self.mu() }).collect()
    }
}

pub fn matrix(rows: usize, columns: usize, mut f: impl FnMut(usize, usize) -> f64) -> Rows {
    (0..rows).map(|i| (0..columns).map(|j| f(i, j)).collect()).collect()
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `B Bᵀ`.
pub fn gram(b: &Rows) -> Rows {
    matrix(b.len(), b.len(), |i, j| dot(&b[i], &b[j]))
}

pub fn times(a: &Rows, x: &[f64]) -> Vec<f64> {
    a.iter().map(|row| dot(row, x)).collect()
}

pub fn transpose(a: &Rows, columns: usize) -> Rows {
    matrix(columns, a.len(), |i, j| a[j][i])
}

/// `2^rows_i a_ij 2^columns_j`.
pub fn scaled(a: &Rows, rows: &[i32], columns: &[i32]) -> Rows {
    matrix(a.len(), columns.len(), |i, j| a[i][j] * 2.0_f64.powi(rows[i] + columns[j]))
}

pub fn scaled_vector(q: &[f64], exponents: &[i32]) -> Vec<f64> {
    q.iter().zip(exponents).map(|(q, &e)| q * 2.0_f64.powi(e)).collect()
}
