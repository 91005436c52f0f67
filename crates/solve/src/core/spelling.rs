//! What somebody may have meant.

/// Names are alike above this (Jaro–Winkler, 1 for equal ones).
const ALIKE: f64 = 0.8;

/// The known name that is most like `word`, if any is like it, in capitals or not.
pub fn nearest<S: AsRef<str>>(word: &str, known: impl IntoIterator<Item = S>) -> Option<String> {
    let word = word.to_lowercase();
    let likeness = |name: S| (strsim::jaro_winkler(&word, &name.as_ref().to_lowercase()), name);
    let alike = known.into_iter().map(likeness).filter(|(likeness, _)| *likeness > ALIKE);
    alike.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name.as_ref().to_owned())
}

/// ` (did you mean …?)` for messages; nothing where no name is alike.
pub fn meant<S: AsRef<str>>(word: &str, known: impl IntoIterator<Item = S>) -> String {
    nearest(word, known).map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised_and_other_words_are_not() {
        let known = ["nsgs", "newton_ac", "condense/nsgs", "auto"];
        assert_eq!(nearest("ngs", known).as_deref(), Some("nsgs"));
        assert_eq!(nearest("newton-ac", known).as_deref(), Some("newton_ac"));
        assert_eq!(nearest("condens/nsgs", known).as_deref(), Some("condense/nsgs"));
        assert_eq!(nearest("NSGS", known).as_deref(), Some("nsgs"));
        assert_eq!(nearest("magic", known), None);
        assert_eq!(meant("atuo", known), " (did you mean `auto`?)");
    }
}
