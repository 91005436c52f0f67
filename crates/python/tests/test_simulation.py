"""Worlds in motion."""

from __future__ import annotations

import os
import pathlib
import signal
import threading

import numpy as np
import pytest

import nonsmooth as ns

EXAMPLES = pathlib.Path(__file__).parents[3] / "examples"


def ball(e=0.0, mu=0.3, height=1.1, **table):
    world = ns.World()
    world.plane()
    world.pair("default", mu=mu, e=e)
    world.sphere(0.1, density=1000, position=[0, 0, height], name="ball", **table)
    return world


def test_a_ball_falls_as_by_hand():
    simulation = ns.Simulation(ball(), h=1e-3)
    run = simulation.run(0.4, every=10)
    assert run.solved and run.bodies == ["body0", "ball"] and len(run.t) == 41
    assert run.position.shape == (41, 2, 3) and run.rotation.shape == (41, 2, 4)
    g = 9.81
    np.testing.assert_allclose(run.position[:, 1, 2], 1.1 - g * run.t**2 / 2, atol=1e-9)
    np.testing.assert_allclose(run.velocity[:, 1, 2], -g * run.t, atol=1e-9)
    np.testing.assert_array_equal(simulation.position, run.position[-1])
    # The same memory each time: no copies.
    assert run.position is run.position and run.energy["kinetic"] is run.energy["kinetic"]
    assert len(run.energy["kinetic"]) == 400 and np.abs(run.energy["imbalance"]).max() < 1e-10


def test_a_sliding_ball_comes_to_roll_and_a_run_goes_on():
    simulation = ns.Simulation(ball(height=0.1, velocity=[1, 0, 0]), h=1e-3)
    first = simulation.run(0.05)
    assert first.contacts()["status"].tolist() == ["slip"]
    run = simulation.run(1.0)
    assert simulation.t == pytest.approx(1.0) and run.solved
    # 5/7 of the velocity is left.
    assert simulation.velocity[1, 0] == pytest.approx(5 / 7, rel=1e-3)
    contacts = run.contacts()
    assert contacts["status"].tolist() == ["stick"] and contacts["r"].shape == (1, 3)
    np.testing.assert_allclose(contacts["normal"], [[0, 0, 1]])
    assert simulation.problem().contacts == 1


def test_moments_of_rolling_friction_balance_the_spin_of_a_ball():
    world = ns.World()
    world.plane()
    world.pair("default", mu=0.3, mu_rolling=1e-3)
    world.sphere(0.1, density=1000, position=[0, 0, 0.1], velocity=[1, 0, 0], name="ball")
    simulation = ns.Simulation(world, h=1e-3)
    simulation.run(0.5)
    before = simulation.angular_velocity[1].copy()
    run = simulation.run(simulation.t + 1e-3)
    contact = run.contacts()[0]
    assert contact["mu_r"] == 1e-3 and np.abs(contact["rolling"]).max() > 0.1
    # The point is that of the middle of the step.
    lever = contact["point"] - run.position[:, 1].mean(axis=0)
    mass = 1000 * 4 / 3 * np.pi * 0.1**3
    spin = 0.4 * mass * 0.1**2 * (simulation.angular_velocity[1] - before)
    np.testing.assert_allclose(spin, np.cross(lever, contact["impulse"]) + contact["moment"], atol=1e-9)
    assert np.abs(contact["moment"]).max() > 1e-6


def test_callbacks_see_and_end():
    simulation, seen = ns.Simulation(ball(), h=1e-3), []

    def watch(step):
        seen.append((step.number, step.t, step.status, step.position[1, 2]))
        return step.number == 7

    run = simulation.run(1.0, on_step=watch)
    assert run.stopped and not run.solved and [s[0] for s in seen] == list(range(1, 8))
    assert seen[0][2] == "solved" and simulation.t == pytest.approx(7e-3)

    def fails(step):
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        simulation.run(1.0, on_step=fails)
    with pytest.raises(ns.Error, match="one that is not running"):
        simulation.run(1.0, on_step=lambda step: simulation.run(2.0))
    assert simulation.run(0.1).solved


def test_a_callback_that_is_none_is_refused_before_a_step():
    simulation = ns.Simulation(ball(), h=1e-3)
    with pytest.raises(ns.Error, match="on_step: expected a function of nonsmooth.Step, found 5"):
        simulation.run(0.01, on_step=5)
    assert simulation.t == 0.0


def test_ctrl_c_ends_a_run():
    simulation = ns.Simulation(ball(), h=1e-6)
    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(1e6, every=10**6)
    assert simulation.t > 0


def test_steps_are_those_of_a_run():
    stepped, ran = ns.Simulation(ball(), h=1e-3), ns.Simulation(ball(), h=1e-3)
    steps = [stepped.step() for _ in range(600)]
    run = ran.run(0.6)
    assert {step.status for step in steps} == {"solved"} and [step.number for step in steps] == list(range(1, 601))
    for name in ("position", "rotation", "velocity", "angular_velocity"):
        np.testing.assert_array_equal(getattr(stepped, name), getattr(ran, name))
    np.testing.assert_array_equal([step.energy["kinetic"] for step in steps], run.energy["kinetic"])
    np.testing.assert_array_equal(steps[299].position, run.position[300])


def test_a_controller_holds_a_ball_that_hovers_and_turns():
    simulation = ns.Simulation(ball(height=2.0, e=0.0), h=1e-3)
    mass = 1000 * 4 / 3 * np.pi * 0.1**3
    forces, torques = np.zeros((2, 3)), np.zeros((2, 3))
    torques[1, 2] = 1e-3
    work = 0.0
    for _ in range(1000):
        error = 1.5 - simulation.position[1, 2]
        forces[1, 2] = mass * (9.81 + 40 * error - 12 * simulation.velocity[1, 2])
        step = simulation.step(forces=forces, torques=torques)
        work += step.energy["forces"]
        assert step.status == "solved" and abs(step.energy["imbalance"]) < 1e-12
    # A torque for a second, on a ball whose inertia is 2/5 m r²; a spring with ω² = 40, damped by 2 · 6, from .5 above.
    np.testing.assert_allclose(simulation.angular_velocity[1], [0, 0, 1e-3 / (0.4 * mass * 0.01)], atol=1e-9)
    left = 0.5 * np.exp(-6.0) * (np.cos(2.0) + 3.0 * np.sin(2.0))
    assert abs(simulation.position[1, 2] - 1.5 - left) < 5e-5 and work < 0
    # They act in the steps that they are asked for, and no longer.
    v = simulation.velocity[1, 2]
    simulation.step()
    assert simulation.velocity[1, 2] == pytest.approx(v - 9.81e-3, abs=1e-12)
    simulation.run(simulation.t + 1e-3)
    assert simulation.velocity[1, 2] == pytest.approx(v - 2 * 9.81e-3, abs=1e-12)


def test_a_simulation_goes_back_to_a_checkpoint():
    simulation, other = ns.Simulation(ball(), h=1e-3), ns.Simulation(ball(), h=1e-3)
    simulation.run(0.44)
    kept = simulation.checkpoint()
    ahead = [simulation.step(forces=[[0, 0, 0], [5.0, 0, 0]]).position for _ in range(300)]
    for again in (simulation, other):
        again.restore(kept)
        assert again.t == pytest.approx(0.44)
        np.testing.assert_array_equal([again.step(forces=[[0, 0, 0], [5.0, 0, 0]]).position for _ in range(300)], ahead)
    for wrong, said in ((b"{}", "checkpoint: expected one of a world of 2 bodies, found"), ("text", "checkpoint: expected bytes")):
        with pytest.raises(ns.Error, match=said):
            simulation.restore(wrong)


@pytest.mark.parametrize(
    "given, said",
    [
        ({"forces": [0, 0, 1]}, "forces: expected finite numbers, bodies × 3 = 2 × 3, found (3,)"),
        ({"torques": "up"}, "torques: expected an array of real numbers, found <U2"),
        (
            {"forces": np.ma.masked_array(np.zeros((2, 3)), mask=np.eye(2, 3, dtype=bool))},
            "forces: expected an array of real numbers, found a masked array (filled() says what stands for what is masked)",
        ),
        ({"torques": [[0, 0, 0], [0, np.inf, 0]]}, "torques[1, 1]: expected a finite number, found inf"),
    ],
)
def test_what_is_asked_of_a_step_is_checked(given, said):
    simulation = ns.Simulation(ball(), h=1e-3)
    with pytest.raises(ns.Error) as caught:
        simulation.step(**given)
    assert str(caught.value) == said and simulation.t == 0


def test_ctrl_c_ends_a_step_and_leaves_the_world_as_it_was():
    world = ns.World()
    world.pair("default", mu=0.3)
    world.generate("polyhedra", count=4000)
    simulation = ns.Simulation(world, h=1e-2, tol=1e-12)
    threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        while True:
            before = simulation.t
            simulation.step()
    assert simulation.t == before


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_threads_that_wait_are_not_asked_for_by_a_process_that_was_forked():
    simulation = ns.Simulation(ball(), h=1e-3)
    simulation.step()
    child = os.fork()
    if child == 0:
        # Nothing of pytest may run here.
        os._exit(0 if simulation.step().number == 2 else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert simulation.step().number == 2


def test_ctrl_c_ends_the_making_of_a_world():
    world = ns.World()
    world.pair("default", mu=0.3)
    world.generate("polyhedra", count=50_000)
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        ns.Simulation(world, h=1e-3)


def test_a_pendulum_has_its_period():
    world = ns.World()
    bob = world.sphere(0.01, mass=1.0, inertia=[1e-6, 1e-6, 1e-6], position=[0.01, 0, -1.0])
    world.revolute("world", bob, anchor=[0, 0, 0], axis=[0, 1, 0])
    run = ns.Simulation(world, h=1e-3).run(4.1)
    x = run.position[:, 0, 0]
    crossings = run.t[1:][(x[:-1] > 0) & (x[1:] <= 0)]
    assert np.diff(crossings)[0] == pytest.approx(2 * np.pi / 9.81**0.5, rel=2e-3)


def test_scenes_of_files_and_robots(tmp_path):
    scenes = sorted((EXAMPLES / "scenes").glob("*.toml"))
    assert scenes
    world = ns.load(scenes[0])
    assert ns.simulate(world, until=world.document["time"]["h"] * 3).solved
    for kind in ("*.urdf", "*.xml"):
        robots = sorted((EXAMPLES / "robots").glob(kind))
        assert robots and ns.load(robots[0]).document["bodies"]
    world = ball()
    world.save(tmp_path / "scene.toml")
    world.save(tmp_path / "scene.json")
    for name in ("scene.toml", "scene.json"):
        run = ns.simulate(tmp_path / name, until=0.01)
        assert run.solved and run.bodies == ["body0", "ball"]


def test_scenes_of_siconos(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "falling.hdf5"
    with h5py.File(path, "w") as file:
        file.attrs["dimension"] = 3
        data = file.create_group("data")
        ref, objects, laws, _ = (data.create_group(n) for n in ("ref", "input", "nslaws", "joints"))
        shape = ref.create_dataset("Ball", (1, 1), dtype=float)
        shape.attrs.update(id=1, type="primitive", primitive="Sphere")
        shape[:] = 0.5
        body = objects.create_group("ball")
        body.attrs.update(mass=1.0, type="dynamic", id=1, translation=[0.0, 0.0, 3.0])
        body.attrs.update(orientation=[1.0, 0, 0, 0], velocity=np.zeros(6))
        part = body.create_dataset("Ball-0", (0, 0), maxshape=(None, 0), dtype=float)
        part.attrs.update(instance_name="Ball-0", shape_name="Ball", group=0)
        part.attrs.update(translation=np.zeros(3), orientation=[1.0, 0, 0, 0])
        law = laws.create_dataset("law", (0,), dtype=float)
        law.attrs.update(type="NewtonImpactFrictionNSL", mu=0.3, e=0.5, gid1=0, gid2=0)
    world = ns.load(path)
    assert any("h = 0.0005" in warning for warning in world.warnings)
    run = ns.simulate(world, until=0.1)
    assert run.solved and run.bodies == ["ball"]
    assert run.velocity[-1, 0, 2] == pytest.approx(-0.980665)
    # Another file of HDF5 is no scene, and says so.
    problem = tmp_path / "problem.hdf5"
    ns.Friction(W=np.eye(3), q=[-1.0, 0, 0], mu=0.3).save(problem)
    with pytest.raises(ns.Error, match="problem.hdf5: expected"):
        ns.load(problem)


def test_a_simulation_runs_once_at_a_time():
    simulation, said = ns.Simulation(ball(), h=1e-3), []

    def meanwhile(_):
        thread = threading.Thread(target=lambda: said.append(refused(simulation)))
        thread.start()
        thread.join()
        return True

    def refused(simulation):
        with pytest.raises(ns.Error) as caught:
            simulation.run(0.1)
        return str(caught.value)

    simulation.run(0.1, on_step=meanwhile)
    assert said == ["simulation: expected one that is not running, found one in a run"]


def test_families(tmp_path):
    world = ns.World()
    world.generate("wall", rows=2, columns=2)
    run = ns.simulate(world, until=0.01, solver=ns.Nsgs(), tol=1e-8)
    assert run.solved and len(run.bodies) > 4


def test_what_is_written_and_shown(tmp_path):
    run = ns.simulate(ball(), until=0.02)
    for name, begins in {
        "r.h5": b"\x89HDF",
        "r.csv": b"step,t",
        "r.html": b"<!",
        "r.glb": b"glTF",
        "r.pvd": b"<",
    }.items():
        run.save(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(begins), name
    assert "<svg" in run.draw()._repr_svg_() and "<svg" in ns.draw(ball())._repr_svg_()
    assert "<iframe" in run._repr_html_() and "<svg" in ball()._repr_html_()
    pytest.importorskip("matplotlib").use("Agg")
    assert run.plot().get_xlabel() == "t (s)"
    with pytest.raises(ns.Error, match="ends in .h5, .csv, .html, .pvd or .glb"):
        run.save(tmp_path / "r.doc")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda w: w.sphere(-1.0, density=1), r"bodies\[2\]"),
        (lambda w: w.sphere(1.0, densty=1), "did you mean `density`"),
        (lambda w: w.sphere(float("nan"), density=1), "expected a finite number, found nan"),
        (lambda w: w.sphere(0.1, density=1, position=[0, 0, 1.15]), "overlap|penetrate|apart"),
        (lambda w: w.joint("hinge", "world", "ball"), "revolute"),
        (lambda w: w.revolute("world", "bal", anchor=[0] * 3, axis=[0, 0, 1]), "bal"),
        (lambda w: w.pair("a", "b", mu=-1.0), "mu|a"),
    ],
)
def test_mistakes_in_worlds_are_one_sentence(change, said):
    world = ball()
    change(world)
    with pytest.raises(ns.Error, match=said):
        ns.Simulation(world)


def test_materials_that_may_meet_need_a_law():
    world = ns.World()
    world.plane(name="floor")
    world.material("stone")
    world.sphere(0.1, density=1, position=[0, 0, 0.1], material="stone", name="ball")
    said = r"materials `(default|stone)` and `(default|stone)`.*may meet.*world\.pair\(\"default\", mu=…\)"
    for make in (ns.Simulation, ns.draw):
        with pytest.raises(ns.Error, match=said):
            make(world)
    with pytest.raises(TypeError, match="mu"):
        world.pair("stone", "default", e=0.5)
    world.pair("stone", "default", mu=0.5)
    run = ns.Simulation(world).run(0.01)
    assert set(run.contacts()["mu"]) == {0.5}
    # A family brings the law among its own bodies, not one of theirs and others'.
    wall = ns.World()
    wall.generate("stack", count=1)
    assert ns.Simulation(wall).run(1e-3).solved
    wall.box([0.1] * 3, density=100, position=[0, 0, 5])
    with pytest.raises(ns.Error, match='world.pair."stack", "default", mu=…|world.pair."default", "stack", mu=…'):
        ns.Simulation(wall)


def test_steps_that_are_none_are_refused():
    simulation = ns.Simulation(ball())
    with pytest.raises(ns.Error, match="every"):
        simulation.run(1.0, every=0)
    with pytest.raises(ns.Error, match="h: expected a positive number"):
        ns.Simulation(ball(), h=-1.0).run(1.0)
    with pytest.raises(ns.Error, match="until"):
        simulation.run(float("inf"))
    with pytest.raises(ns.Error, match=r"until: expected a time of at least 0 s \(it is 0 s\), found -1.0"):
        simulation.run(-1)


@pytest.mark.parametrize("kind", ["fixed", "revolute", "prismatic", "spherical"])
def test_a_box_rests_on_a_table_that_a_joint_holds(kind):
    world = ns.World()
    world.pair("default", mu=0.3)
    world.box([0.5, 0.5, 0.05], name="table", density=500)
    world.box([0.1] * 3, density=500, position=[0, 0, 0.15], name="box")
    more = {"revolute": {"anchor": [0, 0, 0], "axis": [0, 0, 1]}, "prismatic": {"axis": [1, 0, 0]}}
    world.joint(kind, "world", "table", **more.get(kind, {"anchor": [0, 0, 0]} if kind == "spherical" else {}))
    run = ns.Simulation(world).run(0.05)
    assert run.solved and run.residual.max() < 1e-8, (kind, set(run.status), run.residual.max())
    assert abs(run.velocity[-1, 1]).max() < 1e-8


def test_a_world_keeps_what_was_said():
    velocity, world = np.zeros(3), ns.World(gravity=[0, 0, 0])
    world.pair("default", mu=0.3)
    for k in range(3):
        velocity[0] = k
        world.sphere(0.1, density=1, position=[0, k, 0], velocity=velocity)
    assert ns.Simulation(world).velocity[:, 0].tolist() == [0, 1, 2]


def test_limits_are_a_pair_that_may_be_open():
    world = ball()
    world.joint("prismatic", "world", "ball", axis=[0, 0, 1], limits=(-np.inf, 1.0))
    assert world.document["joints"][-1]["limits"] == {"upper": 1.0}
    below = ball()
    below.joint("prismatic", "world", "ball", axis=[0, 0, 1], limits=(-0.1, np.inf))
    assert below.document["joints"][-1]["limits"] == {"lower": -0.1}
    assert ns.Simulation(below).run(1e-3).solved
    for limits in [(-0.5, 0.5, 1.0), np.array([-0.5, 0.5, 1.0]), [0.5]]:
        with pytest.raises(ns.Error, match="limits: expected a pair"):
            world.joint("prismatic", "world", "ball", axis=[0, 0, 1], limits=limits)


def test_numbers_that_are_not_finite_are_named():
    world = ball()
    world.sphere(0.1, density=np.nan)
    with pytest.raises(ns.Error, match=r"scene.bodies\[2\].density: expected a finite number, found nan"):
        ns.Simulation(world)
    assert "density" in world._repr_html_()


def test_a_run_ends_where_it_is_told_to():
    run = ns.Simulation(ball(height=0.1), h=1e-2).run(60.0, every=1000)
    assert len(run.steps["time"]) == 6000 and "60 s" in repr(run)


def test_contacts_of_a_frame_as_a_frame_of_pandas():
    pandas = pytest.importorskip("pandas")
    run = ns.Simulation(ball(height=0.1), h=1e-2).run(0.1)
    table = run.contacts(-1).to_pandas()
    assert isinstance(table, pandas.DataFrame) and {"r_0", "r_1", "r_2", "status"} <= set(table)


def test_a_run_knows_its_joints():
    # A weld carries the weight and its moment; a spindle turns into a rack, which is coupled to it.
    world = ns.World()
    world.box([0.5, 0.1, 0.1], mass=2, inertia=[1, 1, 1], position=[0.5, 0, 0], name="beam")
    world.joint("fixed", "world", "beam", anchor=[0, 0, 0], name="wall")
    world.body(mass=1, inertia=[1, 1, 1], position=[0, 5, 0], torque=[0, 0, 3], name="spindle")
    world.body(mass=2, inertia=[1, 1, 1], position=[0, 9, 0], name="rack")
    world.revolute("world", "spindle", anchor=[0, 5, 0], axis=[0, 0, 1], name="turn")
    world.prismatic("world", "rack", axis=[1, 0, 0], name="slide")
    world.couple({"turn": 1, "slide": -2})
    run = ns.Simulation(world, h=1e-2).run(1.0)
    assert run.solved and run.joints == ["wall", "turn", "slide"]
    wall, slide = run.joint("wall"), run.joint(2)
    assert wall["impulse"].shape == (101, 3) and np.abs(wall["violation"]).max() < 1e-12
    np.testing.assert_allclose(wall["impulse"][1:, 2], 2 * 9.81 * 1e-2)
    np.testing.assert_allclose(wall["moment"][1:, 1], -0.5 * 2 * 9.81 * 1e-2)
    # angle = 2 slide: (1 + 2/4) angle'' = 3, to the O(h²) of a step's turn.
    angle = run.joint("turn")["angle"]
    np.testing.assert_allclose(angle, run.t**2, atol=2e-5)
    np.testing.assert_allclose(slide["slide"], angle / 2, atol=1e-12)
    for unknown in ("door", 3, -1):
        with pytest.raises(ns.Error, match="joint: expected one of"):
            run.joint(unknown)


def test_worlds_in_the_plane_and_elastic_boxes_have_words():
    world = ns.World(dimension=2)
    world.plane()
    world.pair("default", mu=0.3)
    world.disc(0.1, density=100, position=[0, 0.1], velocity=[1, 0], name="disc")
    world.polygon([[0, 0], [0.2, 0], [0, 0.2]], density=100, position=[5, 0])
    run = ns.Simulation(world).run(0.5)
    # A disc that slides rolls with 2/3 of its velocity.
    assert run.solved and run.velocity[-1, 1, 0] == pytest.approx(2 / 3)
    solid = ns.World()
    solid.plane(motion={"kind": "surface", "velocity": [1, 0, 0]})
    solid.pair("default", mu=0.3)
    solid.elastic([0.1, 0.1, 0.1], [1, 1, 1], 1e6, density=1000, position=[0, 0, 0.1])
    assert ns.Simulation(solid).run(0.01).bodies == ["body0", "elastic0"]


def test_contacts_without_a_law_of_their_own_may_give_way():
    world = ns.World()
    world.plane()
    world.pair("default", mu=0.3, compliance={"stiffness": 1e4, "damping": 100})
    world.sphere(0.1, mass=2, inertia=[0.01] * 3, position=[0, 0, 0.1])
    run = ns.Simulation(world).run(3.0)
    assert run.position[-1, 1, 2] == pytest.approx(0.1 - 2 * 9.81 / 1e4, abs=1e-9)


def test_names_that_are_made_are_free():
    world = ns.World()
    assert world.sphere(0.1, name="body1", density=1.0) == "body1"
    made = [world.sphere(0.1, density=1.0, position=[0, 0, k]) for k in (1, 2)]
    assert made == ["body2", "body3"]
    assert world.joint("fixed", *made, name="joint1") == "joint1"
    assert world.joint("fixed", "world", made[0]) == "joint2"
    world.pair("default", mu=0.3)
    ns.Simulation(world)


def test_a_run_without_steps_stays_what_it_was():
    world = ns.World()
    world.sphere(0.1, density=1.0)
    world.pair("default", mu=0.3)
    simulation = ns.Simulation(world)
    simulation.run(0.01)
    none = simulation.run(0.005)
    simulation.run(0.02)
    assert repr(none) == "<Run: 1 bodies, 0 steps to t = 0.01 s, solved>"
