//! What exists: the solvers of each kind of problem and what may stand before their names, and everything that is generated from that.
//!
//! The list of the complementarity wing's kinds is in that wing; contact problems are listed here, where the bridges are known.

use nonsmooth_problem::{
    FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, RollingGlobal, RollingLocal,
};

use crate::bridges::{AsNcp, FacetInner, FacetOuter, First, Glocker};
use crate::contact::condense::Condense;
use crate::contact::form::Regularised;
use crate::contact::proximal::Proximal;
use crate::contact::solvers::{inner_rolling_solvers, inner_solvers, rolling_solvers, solvers};
use crate::contact::weigh::Weighed;

pub use crate::core::register::{
    About, Composed, DEFAULT, Described, Edge, Entry, Prefix, Registered, Solves, about, abouts,
    composed_names, prefixes, session, solver_names, solves,
};

impl Registered for FrictionLocal<2> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 2>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_local()
    }
}

impl Registered for FrictionLocal<3> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 3>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_local()
    }
}

impl Registered for FrictionGlobal<2> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 2>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_global()
    }
}

impl Registered for FrictionGlobal<3> {
    fn solvers() -> Vec<Entry<Self>> {
        solvers::<Self, 3>()
    }

    fn edges() -> Vec<Edge<Self>> {
        of_global()
    }
}

impl Registered for RollingLocal {
    fn solvers() -> Vec<Entry<Self>> {
        rolling_solvers()
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Weighed<Proximal<5>>>()]
    }
}

impl Registered for RollingGlobal {
    fn solvers() -> Vec<Entry<Self>> {
        rolling_solvers()
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Condense>(), Edge::new::<Weighed<Proximal<5>>>()]
    }
}

/// What may stand before a solver's name on a local problem.
fn of_local<const D: usize>() -> Vec<Edge<FrictionLocal<D>>>
where
    Regularised<FrictionLocal<D>>: Registered<Point = LocalPoint>,
{
    vec![
        Edge::new::<Proximal<D>>(),
        Edge::new::<FacetInner<D>>(),
        Edge::new::<FacetOuter<D>>(),
        Edge::new::<AsNcp<First>>(),
        Edge::new::<AsNcp<Glocker>>(),
    ]
}

/// What may stand before a solver's name on a global problem.
fn of_global<const D: usize>() -> Vec<Edge<FrictionGlobal<D>>>
where
    FrictionLocal<D>: Registered,
    Regularised<FrictionGlobal<D>>: Registered<Point = GlobalPoint>,
{
    vec![Edge::new::<Condense>(), Edge::new::<Proximal<D>>()]
}

impl Registered for Regularised<FrictionLocal<2>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 2>()
    }
}

impl Registered for Regularised<FrictionLocal<3>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 3>()
    }
}

impl Registered for Regularised<FrictionGlobal<2>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 2>()
    }
}

impl Registered for Regularised<FrictionGlobal<3>> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_solvers::<_, 3>()
    }
}

impl Registered for Regularised<RollingLocal> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_rolling_solvers()
    }
}

impl Registered for Regularised<RollingGlobal> {
    fn solvers() -> Vec<Entry<Self>> {
        inner_rolling_solvers()
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::{FrictionGlobal, FrictionLocal, Problem};

    use super::*;
    use crate::settings::SettingsMap;

    fn refusal(texts: &[&str]) -> String {
        let map = crate::core::settings::from_texts(texts).unwrap();
        session::<FrictionLocal<3>>("nsgs", &map).err().expect("refused").to_string()
    }

    #[test]
    fn mistakes_in_settings_name_key_expected_and_found() {
        assert_eq!(
            refusal(&["omga=1"]),
            "solver `nsgs`: unknown key `omga` (did you mean `omega`?); there are: local, local_tolerance, omega, omega_min, \
             ordering, seed, freeze_after, freeze_for, anderson, anderson_every, check_every"
        );
        assert_eq!(
            refusal(&["omega=2.5"]),
            "solver `nsgs`: omega: expected a number in (0, 2), found 2.5"
        );
        assert_eq!(
            refusal(&["omega=fast"]),
            "solver `nsgs`: omega: expected a number, found \"fast\""
        );
        assert!(refusal(&["local=magic"]).contains("local: expected one of exact, quartic,"));
        assert!(refusal(&["seed=-1"]).contains("seed: expected a whole number"));
        assert!(refusal(&["check_every=0"]).contains("check_every: expected at least 1, found 0"));
    }

    #[test]
    fn unknown_solvers_are_refused_with_those_that_exist() {
        let e = session::<FrictionLocal<3>>("lemke", &SettingsMap::new()).err().expect("refused");
        assert!(e.to_string().contains("unknown solver `lemke`") && e.to_string().contains("nsgs"));
        for name in ["condense/nsgs", "facet/nsgs", "nsgs/condense"] {
            assert!(session::<FrictionLocal<3>>(name, &SettingsMap::new()).is_err(), "{name}");
        }
        assert!(session::<FrictionGlobal<3>>("condense/nsgs", &SettingsMap::new()).is_ok());
    }

    #[test]
    fn every_setting_is_documented() {
        for about in abouts::<FrictionLocal<3>>() {
            let settings = (about.settings)();
            assert!(!settings.is_empty(), "{}", about.name);
            assert!(settings.iter().all(|s| !s.help.is_empty()), "{}: {settings:?}", about.name);
        }
    }

    /// Methods that share no iteration find the same motion where W is regular.
    #[test]
    fn independent_methods_agree() {
        use nonsmooth_problem::planted::Planted;
        let planted = Planted { contacts: 20, dofs: 120, seed: 11, ..Planted::default() };
        let (problem, _) = planted.local::<3>();
        let motion = |name: &str, texts: &[&str]| {
            let settings = crate::core::settings::from_texts(texts).unwrap();
            let mut session = session::<FrictionLocal<3>>(name, &settings).unwrap();
            let mut point = problem.origin();
            let limits = crate::Limits {
                tolerance: 1e-11,
                max_iterations: 100_000,
                ..crate::Limits::default()
            };
            let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(outcome.status, crate::Status::Solved, "{name} {texts:?}");
            let mut u = vec![0.0; problem.q.len()];
            problem.W.mul_plus(&point.r, &problem.q, &mut u);
            u
        };
        let reference = motion("nsgs", &[]);
        let size = nonsmooth_linalg::norm(&problem.q);
        for (name, texts) in [
            ("psor", vec![]),
            ("nsgs_colored", vec!["threads=2", "serial_below=1"]),
            ("nsgs", vec!["anderson=5"]),
            ("nsgs", vec!["local=newton_ac", "local_tolerance=adaptive"]),
            ("nsgs", vec!["local=projection_iterated", "local_tolerance=adaptive"]),
            ("extragradient", vec!["rule=solodov_tseng"]),
            ("hyperplane", vec![]),
            ("proximal/extragradient", vec![]),
            ("admm", vec![]),
            ("admm", vec!["rule=fixed", "anderson=5"]),
            ("proximal/nsgs", vec![]),
            ("proximal/admm", vec!["prox_rule=residual"]),
        ] {
            let u = motion(name, &texts);
            let far = u.iter().zip(&reference).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(far < 1e-8 * size, "{name} {texts:?}: {far:e}");
        }
    }
}
