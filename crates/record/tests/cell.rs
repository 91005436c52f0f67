//! What pictures show of a world that repeats itself: bodies in the cell, contacts where these are.

use nonsmooth_io::trajectory::Trajectory;
use nonsmooth_record::{begun, frame, in_cell, playback};
use nonsmooth_scenes::vec3::{norm, sub};
use nonsmooth_simulate::{SceneFile, Shape};

#[test]
fn bodies_are_in_the_cell_and_contacts_on_both_bodies() {
    let text = r#"{"count": 30, "dilation": 0.3, "shear": 3.0}"#;
    let scene = SceneFile {
        gravity: [0.0; 3],
        ..SceneFile::of_family("periodic_box", serde_json::from_str(text).unwrap(), 2e-3, 1.0)
    };
    let mut simulation = scene.build().unwrap();
    let mut run = Trajectory { frames: vec![frame(&simulation)], ..begun(&scene, &simulation) };
    let mut speed = 0.0_f64;
    for _ in 0..60 {
        simulation.step(2e-3).unwrap();
        run.frames.push(frame(&simulation));
        speed = simulation.state().velocity.iter().map(|v| norm(*v)).fold(speed, f64::max);
    }
    let world = simulation.world();
    let radius = |k: u32| match world.bodies[k as usize].parts[0].shape {
        Shape::Sphere { radius } => radius,
        ref other => panic!("{other:?}"),
    };
    let shown = in_cell(&run, world);
    let (mut moved, mut images) = (0, 0);
    for (frame, whole) in shown.frames.iter().zip(&run.frames) {
        let periods = world.periods_at(frame.time);
        let far: f64 = periods.iter().map(|p| norm(*p)).sum();
        for (state, from) in frame.bodies.iter().zip(&whole.bodies) {
            moved += usize::from(state.position != from.position);
            assert!(norm(state.position) <= far);
            // In a cell whose corner is the origin no body is behind its floor.
            assert!(state.position[2] >= -1e-12 && state.position[2] <= far);
        }
        for c in &frame.contacts {
            let at = |k: u32| frame.bodies[k as usize].position;
            // Contacts are those of the middle of the step, gaps those of its beginning.
            let slack = 2e-3 * 2.0 * speed + c.gap.abs();
            assert!((norm(sub(c.point, at(c.b))) - radius(c.b)).abs() <= slack);
            assert!((norm(sub(sub(c.point, c.offset), at(c.a))) - radius(c.a)).abs() <= slack);
            images += usize::from(norm(c.offset) > 1e-9);
        }
    }
    assert!(moved > 100 && images > 100, "{moved} {images}");
    // Nothing flies across the cell from frame to frame but by a jump.
    let played = playback(&run, &scene, world);
    assert!(
        played
            .jump
            .is_some_and(|jump| jump > 0.05 && jump < 0.5 * norm(world.periods_at(0.0)[0]) * 1.001)
    );
    played.html(10_000_000).unwrap();
    played.picture(60).unwrap();
}
