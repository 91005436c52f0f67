//! A run that is killed at any time: what was written opens, and it goes on from there as if nothing had been.

use std::time::Duration;

use crate::common::Folder;
use nonsmooth_io::trajectory::Trajectory;

/// A wall that is knocked over, for some seconds of computing.
const SCENE: &str = r#"
format = "nonsmooth-scene"
version = 1
time = { h = 1e-3, end = 6.0 }
pairs_default = { mu = 0.4, e = 0.1 }

[[generate]]
scene = "wall"
set = { rows = 3, columns = 3 }

[[bodies]]
name = "ball"
shape = { kind = "sphere", radius = 0.2 }
density = 2000
position = [0, -3, 1]
velocity = [0, 2, 1]
"#;

/// The same but for the time that steps took.
fn alike(run: &Trajectory) -> Trajectory {
    let mut run = run.clone();
    run.steps.iter_mut().for_each(|step| step.wall = 0.0);
    run
}

#[test]
fn what_a_killed_run_has_written_opens_and_goes_on_bit_for_bit() {
    let folder = Folder::new();
    std::fs::write(folder.path("scene.toml"), SCENE).unwrap();
    folder.run("simulate scene.toml --out whole.h5 --every 3");
    let whole = alike(&Trajectory::read(folder.path("whole.h5")).unwrap());
    let end = whole.steps.len();
    assert!(end > 1000, "{end}");

    let file = folder.path("run.h5");
    // The same sequence of waits each time, from no time to a good part of the run.
    let mut random = 12_345_u64;
    let (mut kills, mut grown, mut most) = (0, 0, 0);
    while kills < 40 {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let wait = Duration::from_micros(20_000 + (random >> 33) % 300_000);
        let mut command = folder.command();
        command.args("simulate scene.toml --every 3 --flush 0.004 --out run.h5".split(' '));
        if file.exists() {
            command.args(["--resume", "run.h5"]);
        }
        let mut child = command
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(wait);
        // What can be read just before is there afterwards.
        let before = match file.exists() {
            true => Trajectory::read(&file).unwrap().steps.len(),
            false => 0,
        };
        child.kill().unwrap();
        let ended = child.wait().unwrap();
        kills += 1;
        if !file.exists() {
            continue;
        }
        let run = alike(&Trajectory::read(&file).unwrap());
        let steps = run.steps.len();
        assert!(steps >= before && steps >= most, "{steps} of {before}, {most}");
        assert_eq!(run.steps[..], whole.steps[..steps]);
        assert_eq!(run.frames[..], whole.frames[..run.frames.len()]);
        assert_eq!(run.frames.len(), 1 + steps / 3);
        assert_eq!(run.checkpoint.as_ref().map(|c| c.step), Some(steps as u64));
        grown += usize::from(steps > most);
        most = steps;
        if ended.success() || steps == end {
            break;
        }
    }
    assert!(grown > 3, "{kills} kills, {most} steps");
    folder.run("simulate scene.toml --every 3 --resume run.h5");
    let run = alike(&Trajectory::read(&file).unwrap());
    assert!(run == whole, "to the last bit");
    // One file is left, and others that were being made are gone.
    assert!(!folder.path("run.h5.parts").exists());
}
