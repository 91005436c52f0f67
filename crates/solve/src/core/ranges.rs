//! Ranges of settings, for [`Settings::validate`](crate::core::settings::Settings::validate): the message names the key, what is expected and what was found.

fn expect(
    holds: bool,
    key: &str,
    expected: &str,
    found: impl std::fmt::Display,
) -> Result<(), String> {
    if holds { Ok(()) } else { Err(format!("{key}: expected {expected}, found {found}")) }
}

/// `0 < x < ∞`.
pub fn positive(key: &str, x: f64) -> Result<(), String> {
    expect(x > 0.0 && x.is_finite(), key, "a positive number", x)
}

/// `0 ≤ x < ∞`.
pub fn nonnegative(key: &str, x: f64) -> Result<(), String> {
    expect(x >= 0.0 && x.is_finite(), key, "a number of at least 0", x)
}

/// `0 < x < high`.
pub fn below(key: &str, x: f64, high: f64) -> Result<(), String> {
    expect(x > 0.0 && x < high, key, &format!("a number in (0, {high})"), x)
}

/// `0 < x ≤ high`.
pub fn up_to(key: &str, x: f64, high: f64) -> Result<(), String> {
    expect(x > 0.0 && x <= high, key, &format!("a number in (0, {high}]"), x)
}

/// `n ≥ least`, of a count.
pub fn at_least(key: &str, n: usize, least: usize) -> Result<(), String> {
    expect(n >= least, key, &format!("at least {least}"), n)
}

/// `n ≤ most`, of a count.
pub fn at_most(key: &str, n: usize, most: usize) -> Result<(), String> {
    expect(n <= most, key, &format!("at most {most}"), n)
}
