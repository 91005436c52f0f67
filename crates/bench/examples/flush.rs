//! What a flush of a growing trajectory costs: cargo run --release -p nonsmooth-bench --example flush [FRAMES [BODIES]]
//!
//! A run of 20 bodies grows to 10⁵ frames (a step each, 4 contacts) and is flushed every 500. Printed are, at powers of two, the time of a flush into parts, the mean of all so far,
//! and what writing the whole file takes.

use std::time::Instant;

use nonsmooth_io::trajectory::{Contact, Frame, Named, State, Step, Trajectory, Writer};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|word| word.parse::<usize>());
    let frames = arguments.next().transpose()?.unwrap_or(100_000);
    let bodies = arguments.next().transpose()?.unwrap_or(20);
    let folder = std::env::temp_dir().join(format!("nonsmooth-flush-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let named = |k: usize| Named { name: format!("body {k}"), fixed: false };
    let mut run = Trajectory {
        scene: "a run that grows".into(),
        bodies: (0..bodies).map(named).collect(),
        ..Trajectory::default()
    };
    let mut writer = Writer::new(folder.join("run.h5"), false);
    writer.flush(&run)?;
    let (mut total, mut flushes) = (0.0, 0);
    println!("{:>8} {:>12} {:>12} {:>12}", "frames", "flush", "mean", "whole");
    for k in 1..=frames as u64 {
        let t = 1e-3 * k as f64;
        let wave = |b: usize| (t + b as f64).sin();
        let state = |b: usize| State {
            position: [b as f64, wave(b), wave(b + 1)],
            rotation: [wave(b), 0.0, 0.0, wave(b + 2)],
            velocity: [0.0, wave(b + 3), wave(b + 4)],
            angular_velocity: [wave(b + 5); 3],
        };
        let contact = |c: u32| Contact {
            key: [c, 0, 0, 0],
            a: 0,
            b: 1,
            point: [wave(7); 3],
            offset: [0.0; 3],
            frame: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            gap: 0.0,
            mu: 0.5,
            r: [wave(8); 3],
            u: [wave(9); 3],
            mu_r: 0.0,
            moment: [0.0; 2],
            rolling: [0.0; 2],
            status: None,
        };
        run.frames.push(Frame {
            step: k,
            time: t,
            bodies: (0..bodies).map(state).collect(),
            contacts: (0..4).map(contact).collect(),
            joints: vec![],
            elastic: vec![],
        });
        run.steps.push(Step { number: k, time: t, status: "solved".into(), ..Step::default() });
        if !k.is_multiple_of(500) {
            continue;
        }
        let begun = Instant::now();
        writer.flush(&run)?;
        let flush = begun.elapsed().as_secs_f64();
        (total, flushes) = (total + flush, flushes + 1);
        if (k / 500).is_power_of_two() || k == frames as u64 {
            let begun = Instant::now();
            run.write(folder.join("whole.h5"))?;
            let whole = begun.elapsed().as_secs_f64();
            let mean = total / f64::from(flushes);
            println!(
                "{k:>8} {:>9.1} ms {:>9.1} ms {:>9.1} ms",
                1e3 * flush,
                1e3 * mean,
                1e3 * whole
            );
        }
    }
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}
