//! Hostile problems, their truth, and the test of every claim about them; shared by the example that runs for hours and the test that runs
//! for seconds, each of which uses a part.
#![allow(dead_code)]

pub mod cases;
pub mod claims;
pub mod draft;
pub mod exact;
pub mod files;
pub mod kinds;
pub mod oracle;

use std::path::Path;

use nonsmooth::{BoxLcp, FrictionGlobal, FrictionLocal, Hlcp, Lcp, Mlcp};
use nonsmooth_io::IoError;

use cases::Made;
use claims::{Attack, Effort, Tally};
use kinds::Hostile;

/// All solvers of all kinds.
pub struct All {
    lcp: Attack<Lcp>,
    mlcp: Attack<Mlcp>,
    hlcp: Attack<Hlcp>,
    boxed: Attack<BoxLcp>,
    local2: Attack<FrictionLocal<2>>,
    local3: Attack<FrictionLocal<3>>,
    global2: Attack<FrictionGlobal<2>>,
    global3: Attack<FrictionGlobal<3>>,
}

/// The names of the kinds, in the order in which problems go round.
pub const KINDS: [&str; 8] = [
    "lcp",
    "mlcp",
    "hlcp",
    "box_lcp",
    "friction_local_2d",
    "friction_local_3d",
    "friction_global_2d",
    "friction_global_3d",
];

/// Evaluates an expression for the attack on a kind.
macro_rules! with_kind {
    ($all:expr, $kind:expr, $attack:ident => $body:expr) => {
        match $kind {
            "lcp" => {
                let $attack = &mut $all.lcp;
                $body
            }
            "mlcp" => {
                let $attack = &mut $all.mlcp;
                $body
            }
            "hlcp" => {
                let $attack = &mut $all.hlcp;
                $body
            }
            "box_lcp" => {
                let $attack = &mut $all.boxed;
                $body
            }
            "friction_local_2d" => {
                let $attack = &mut $all.local2;
                $body
            }
            "friction_local_3d" => {
                let $attack = &mut $all.local3;
                $body
            }
            "friction_global_2d" => {
                let $attack = &mut $all.global2;
                $body
            }
            _ => {
                let $attack = &mut $all.global3;
                $body
            }
        }
    };
}

impl All {
    pub fn new() -> Self {
        Self {
            lcp: Attack::new(),
            mlcp: Attack::new(),
            hlcp: Attack::new(),
            boxed: Attack::new(),
            local2: Attack::new(),
            local3: Attack::new(),
            global2: Attack::new(),
            global3: Attack::new(),
        }
    }

    /// One problem of a kind, asked of everybody.
    pub fn run(
        &mut self,
        kind: &str,
        seed: u64,
        index: u64,
        effort: &Effort,
        doing: &dyn Fn(&str),
    ) -> Tally {
        with_kind!(self, kind, attack => attack.run(seed, index, effort, doing))
    }
}

/// Evaluates an expression for a kind as a type.
macro_rules! with_type {
    ($kind:expr, $problem:ident => $body:expr) => {
        match $kind {
            "lcp" => {
                type $problem = Lcp;
                $body
            }
            "mlcp" => {
                type $problem = Mlcp;
                $body
            }
            "hlcp" => {
                type $problem = Hlcp;
                $body
            }
            "box_lcp" => {
                type $problem = BoxLcp;
                $body
            }
            "friction_local_2d" => {
                type $problem = FrictionLocal<2>;
                $body
            }
            "friction_local_3d" => {
                type $problem = FrictionLocal<3>;
                $body
            }
            "friction_global_2d" => {
                type $problem = FrictionGlobal<2>;
                $body
            }
            _ => {
                type $problem = FrictionGlobal<3>;
                $body
            }
        }
    };
}

/// Writes a problem as a file.
pub fn save(kind: &str, seed: u64, index: u64, path: &Path) -> Result<(), IoError> {
    with_type!(kind, P => P::case(seed, index).problem.save(path))
}

/// A problem in words.
pub fn described(kind: &str, seed: u64, index: u64) -> String {
    with_type!(kind, P => {
        let case = P::case(seed, index);
        format!("{:?}\n{} {:?} fine {:e}", case.problem, case.recipe, case.truth, case.fine)
    })
}
