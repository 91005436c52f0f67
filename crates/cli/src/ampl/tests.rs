use super::options::{Options, pairs_in, pairs_of};
use super::*;

fn pair(key: &str, value: &str) -> (String, String) {
    (key.into(), value.into())
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(Into::into).collect()
}

#[test]
fn options_of_the_environment_are_words_with_or_without_a_sign() {
    let all =
        pairs_of(" tol=1e-9 solver auto\tname = \"two words\" text='a=b' version x=y=z").unwrap();
    let expected = [
        pair("tol", "1e-9"),
        pair("solver", "auto"),
        pair("name", "two words"),
        pair("text", "a=b"),
        pair("version", ""),
        pair("x", "y=z"),
    ];
    assert_eq!(all, expected);
    assert_eq!(pairs_of("").unwrap(), []);
    assert!(pairs_of("tol").is_err() && pairs_of("=3").is_err() && pairs_of("tol=").is_err());
}

#[test]
fn arguments_may_hold_blanks() {
    let arguments = ["tol=1e-9".to_owned(), "name=two words".into(), "wantsol".into(), "3".into()];
    let expected = [pair("tol", "1e-9"), pair("name", "two words"), pair("wantsol", "3")];
    assert_eq!(pairs_in(&arguments).unwrap(), expected);
}

#[test]
fn the_last_of_a_key_counts_and_what_path_knows_is_passed_by() {
    let mut options = Options::default();
    let all = pairs_of("tol=1e-3 convergence_tolerance=1e-9 crash_method=none output=no omega=0.5");
    options.set(&all.unwrap()).unwrap();
    assert_eq!(options.tolerance, 1e-9);
    assert_eq!(options.ignored, ["crash_method", "output"]);
    assert_eq!(options.settings.len(), 1);
    for text in ["tol=small", "tol=0", "tol=2", "max_iter=1.5", "time_limit=-1", "wantsol=1000"] {
        let mistake = options.set(&pairs_of(text).unwrap()).unwrap_err();
        assert!(mistake.contains(text.split('=').next().unwrap()), "{mistake}");
    }
}

#[test]
fn flags_stand_before_the_stub() {
    let call = Call::new(&words("-e -s -ox.sol -bbounds stub -AMPL tol=1")).unwrap();
    let expected = Call {
        silent: true,
        writes: true,
        solution: Some("x.sol".into()),
        bounds: Some("bounds".into()),
        stub: Some("stub".into()),
        ampl: true,
        words: words("tol=1"),
        ..Call::default()
    };
    assert_eq!(call, expected);
    let dashed = Call::new(&words("-- -stub")).unwrap();
    assert_eq!(dashed.stub.as_deref(), Some("-stub"));
    assert!(Call::new(&words("-x stub")).is_err());
    assert!(calls(&words("nonsmooth stub -AMPL")) && calls(&words("nonsmooth -v")));
    assert!(!calls(&words("nonsmooth solve a.nl")));
}

#[test]
fn variables_follow_the_name_of_the_program() {
    assert_eq!(variables("pathampl"), ["nonsmooth_options", "path_options", "pathampl_options"]);
    assert_eq!(variables("nonsmooth"), ["nonsmooth_options"]);
    assert_eq!(variables("nonsmooth-ampl"), ["nonsmooth_options", "nonsmooth-ampl_options"]);
}
