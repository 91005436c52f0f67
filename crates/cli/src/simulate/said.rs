//! What is said of a run.

use std::path::{Path, PathBuf};

use nonsmooth_simulate::{RunReport, SceneFile, Settled, Simulation};
use serde_json::{Value, json};

use super::record::Recorder;
use crate::report::{number, row};
use crate::solve::seconds;

/// A run that has ended.
pub struct Run<'a> {
    pub path: &'a Path,
    pub scene: &'a SceneFile,
    pub simulation: &'a Simulation,
    pub recorder: &'a Recorder,
    pub report: &'a RunReport,
    pub settled: Option<Settled>,
    pub seconds: f64,
    pub written: &'a [PathBuf],
}

impl Run<'_> {
    /// The report. Its last line says whether every step is solved.
    pub fn text(&self, timings: bool) -> String {
        let Self { scene, simulation, report, .. } = self;
        let mut text = format!("{}: {report}\n", self.path.display());
        let world = simulation.world();
        let free = world.bodies.iter().filter(|b| b.is_free()).count();
        let name = if scene.name.is_empty() { String::new() } else { format!("{}, ", scene.name) };
        let elastic = match world.elastic.len() {
            0 => String::new(),
            1 => ", 1 elastic solid".into(),
            n => format!(", {n} elastic solids"),
        };
        row(
            &mut text,
            "scene",
            format!("{name}{} bodies, {free} of them free{elastic}", world.bodies.len()),
        );
        let scheme = format!(
            "h = {} s, theta = {}, contacts by {} to {:e}",
            scene.time.h, scene.integrator.theta, scene.solver.name, scene.solver.tol
        );
        row(&mut text, "scheme", scheme);
        if let Some(s) = self.settled.filter(|s| s.rounds > 0) {
            let says = format!(
                "{} pairs overlapped by up to {} m; moved apart in {} rounds, by up to {} m",
                s.pairs,
                number(s.depth),
                s.rounds,
                number(s.moved)
            );
            row(&mut text, "settled", says);
        }
        let steps = &self.recorder.trajectory.steps[self.recorder.earlier..];
        if let Some(last) = steps.last() {
            let most = steps.iter().map(|s| s.active).max().unwrap_or(0);
            let counts = format!(
                "{} active at the end ({} open, {} stick, {} slip), at most {most}",
                last.active, last.open, last.stick, last.slip
            );
            row(&mut text, "contacts", counts);
            let e = &last.energy;
            let energy = format!(
                "kinetic {} J, potential {} J at the end; imbalance of a step at most {} of its terms",
                number(e.kinetic),
                number(e.potential),
                number(report.imbalance)
            );
            row(&mut text, "energy", energy);
        }
        if let Some(violation) = self.violation() {
            let says = format!(
                "{}, violated by {} at most at the end",
                world.joints.len(),
                number(violation)
            );
            row(&mut text, "joints", says);
        }
        let mut drift = format!("penetration at most {} m", number(report.penetration));
        if report.joints > 0.0 {
            drift += &format!(", joints violated by {} at most", number(report.joints));
        }
        row(&mut text, "drift", drift);
        let rate = report.steps as f64 / self.seconds.max(1e-9);
        row(&mut text, "time", format!("{}, {rate:.0} steps a second", seconds(self.seconds)));
        if timings {
            let total: f64 = steps.iter().map(|s| s.wall).sum();
            let mut walls: Vec<f64> = steps.iter().map(|s| s.wall).collect();
            walls.sort_by(f64::total_cmp);
            let at = |share: f64| {
                let k = (share * walls.len() as f64) as usize;
                walls.get(k.min(walls.len().saturating_sub(1))).copied().unwrap_or(0.0)
            };
            let says = format!(
                "{} in steps; a step: median {}, 95 % below {}",
                seconds(total),
                seconds(at(0.5)),
                seconds(at(0.95))
            );
            row(&mut text, "", says);
        }
        for path in self.written {
            row(&mut text, "written", path.display());
        }
        for warning in simulation.warnings() {
            row(&mut text, "note", warning);
        }
        row(&mut text, "result", self.result());
        text
    }

    /// The most by which an equation of a joint is violated at the end, where there are joints.
    fn violation(&self) -> Option<f64> {
        self.simulation.joints().iter().map(|j| j.violation).reduce(f64::max)
    }

    fn result(&self) -> String {
        let report = self.report;
        let stopped = if report.stopped {
            format!(", stopped at t = {} s of {} s", report.t, self.scene.time.end)
        } else {
            String::new()
        };
        let deep = match report.first_deep {
            Some(t) => format!(
                ", but bodies overlap by more than a tenth of their size in {} of them, first at t = {t} s",
                report.deep
            ),
            None => String::new(),
        };
        let (steps, unsolved) = (report.steps, report.unsolved);
        match report.first_unsolved {
            None => format!("every one of {steps} steps solved{deep}{stopped}"),
            Some(t) => {
                format!(
                    "NOT SOLVED: {unsolved} of {steps} steps, the first at t = {t} s{deep}{stopped}"
                )
            }
        }
    }

    /// The report as JSON.
    pub fn json(&self) -> Value {
        let Self { report, simulation, .. } = self;
        let last = self.recorder.trajectory.steps.last();
        json!({
            "scene": self.path.to_string_lossy(),
            "name": self.scene.name,
            "bodies": simulation.world().bodies.len(),
            "status": if super::complete(report) { "solved" } else { "not_solved" },
            "message": self.result(),
            "steps": report.steps,
            "statuses": report.statuses,
            "t": report.t,
            "stopped": report.stopped,
            "residual": report.residual,
            "imbalance": report.imbalance,
            "penetration": report.penetration,
            "joint_drift": report.joints,
            "deep": report.deep,
            "joint_violation": self.violation(),
            "notes": simulation.warnings(),
            "settled": self.settled.map(|s| json!({
                "pairs": s.pairs, "depth": s.depth, "rounds": s.rounds, "moved": s.moved,
            })),
            "seconds": self.seconds,
            "kinetic": last.map(|s| s.energy.kinetic),
            "potential": last.map(|s| s.energy.potential),
            "written": self.written.iter().map(|path| path.to_string_lossy()).collect::<Vec<_>>(),
        })
    }
}
