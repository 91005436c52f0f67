//! Rolling friction in units of velocity: `u' = D u`, `r = D r'`, `W' = D W D`, `D_c = diag(1, 1, 1, ℓ_c, ℓ_c)`, `mu_r' = mu_r/ℓ_c`.
//!
//! Methods weigh all rows of a contact alike (a step length, a radius, a merit), and angular velocities are no velocities. With the arm ℓ_c of the problem's statement
//! (`nonsmooth_problem::Weighed`), a power of two, nothing is rounded on the way there or back, and every solver of problems with rolling friction works on the problem in u'.
//!
//! Cost: a copy of the problem.

use std::marker::PhantomData;

use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{
    FrictionGlobal, FrictionLocal, GlobalPoint, Kind, LocalPoint, Problem, Weighed as _,
};

use crate::contact::law::DiskLaw;
use crate::core::reformulation::Reformulation;
use crate::core::register::Composed;
use crate::{Boxed, SolveError, Via};

/// The change of units.
#[derive(Debug, Clone, Copy, Default)]
pub struct Weigh;

/// A contact problem whose solvers see it in units of velocity, and how its points go there and back.
macro_rules! weigh {
    ($problem:ident, $point:ident) => {
        impl<const D: usize, L: DiskLaw<D>> Reformulation<$problem<D, L>> for Weigh {
            type To = $problem<D, L>;
            /// ℓ_c.
            type Memo = Vec<f64>;

            fn reduce(
                &self,
                problem: &$problem<D, L>,
            ) -> Result<($problem<D, L>, Vec<f64>), SolveError> {
                let arms = problem.arms().unwrap_or_else(|| vec![1.0; problem.contacts()]);
                Ok((problem.weighed(&arms), arms))
            }

            fn lower(
                &self,
                _: &$problem<D, L>,
                point: &$point,
                arms: &Vec<f64>,
                reduced: &mut $point,
            ) {
                reduced.clone_from(point);
                $problem::<D, L>::weigh(arms, &mut reduced.r);
            }

            fn lift(
                &self,
                _: &$problem<D, L>,
                reduced: &$point,
                arms: &mut Vec<f64>,
                point: &mut $point,
            ) {
                point.clone_from(reduced);
                $problem::<D, L>::unweigh(arms, &mut point.r);
            }

            fn lift_certificate(&self, certificate: Certificate, arms: &Vec<f64>) -> Certificate {
                match certificate {
                    Certificate::Impulses(mut ray) => {
                        $problem::<D, L>::unweigh(arms, &mut ray.r);
                        Certificate::Impulses(ray)
                    }
                    other => other,
                }
            }
        }
    };
}

weigh!(FrictionLocal, LocalPoint);
weigh!(FrictionGlobal, GlobalPoint);

/// The prefix C on problems with rolling friction, in units of velocity.
pub struct Weighed<C>(PhantomData<C>);

impl<P, C> Composed<P> for Weighed<C>
where
    P: Problem<Point: 'static> + Send + 'static,
    C: Composed<P>,
    Weigh: Reformulation<P, To = P, Memo: 'static>,
{
    type To = C::To;
    type Settings = C::Settings;
    const NAME: &'static str = C::NAME;
    const SUMMARY: &'static str = C::SUMMARY;
    const FROM: &'static [Kind] = C::FROM;
    const CITES: &'static [&'static str] = C::CITES;
    const KEYS: &'static str = C::KEYS;
    const NEARLY: bool = C::NEARLY;

    fn compose(settings: C::Settings, solver: Boxed<C::To>) -> Boxed<P> {
        Boxed::new(Via { reformulation: Weigh, solver: C::compose(settings, solver) })
    }

    fn lists(solver: &str) -> bool {
        C::lists(solver)
    }
}
