//! The contract of a reformulation: problem → problem, with the way back.

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Certificate;

use crate::SolveError;

/// An edge between two kinds of problem that can be walked both ways.
pub trait Reformulation<P: Problem>: Send + Sync {
    /// The other kind of problem.
    type To: Problem + Send;
    /// What the way back needs.
    type Memo: Send;

    /// The other problem, and the memo of the way back.
    fn reduce(&self, problem: &P) -> Result<(Self::To, Self::Memo), SolveError>;

    /// Reduces another problem into what an earlier one was reduced to, reusing what still serves.
    fn reduce_again(
        &self,
        problem: &P,
        reduced: &mut Self::To,
        memo: &mut Self::Memo,
    ) -> Result<(), SolveError> {
        (*reduced, *memo) = self.reduce(problem)?;
        Ok(())
    }

    /// A verified certificate that the first problem has no solution, where the reduction has come upon one.
    fn contradiction(&self, _memo: &Self::Memo) -> Option<Certificate> {
        None
    }

    /// What a certificate that the other problem has no solution says of the first. As it is, unless the reformulation knows better: the
    /// first problem's judge decides what it proves.
    fn lift_certificate(&self, certificate: Certificate, _memo: &Self::Memo) -> Certificate {
        certificate
    }

    /// What is to be said when the other problem is solved and the first is not, of a reformulation whose solutions are those of the first problem only
    /// nearly: then the other problem's own judge is asked as well, since the first one's may never be content.
    fn approximates(&self) -> Option<&'static str> {
        None
    }

    /// A point of the first problem as a starting point of the other.
    fn lower(
        &self,
        problem: &P,
        point: &P::Point,
        memo: &Self::Memo,
        reduced: &mut <Self::To as Problem>::Point,
    );

    /// A point of the other problem as a point of the first.
    fn lift(
        &self,
        problem: &P,
        reduced: &<Self::To as Problem>::Point,
        memo: &mut Self::Memo,
        point: &mut P::Point,
    );
}
