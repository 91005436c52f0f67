"""Times MuJoCo's steps on the worlds that the example `steps` of nonsmooth-simulate writes: median processor time in ms of 1000 steps of 5 ms, one thread.

    cargo run --release -p nonsmooth-simulate --example steps -- 1e-8 1000 FOLDER
    pip install mujoco && python docs/benchmarks/simulation_mujoco.py FOLDER
"""

import json
import pathlib
import statistics
import sys
import time

import mujoco


def model(bodies, solver, mu):
    xml = [
        f'<mujoco><option timestep="0.005" cone="elliptic" solver="{solver}" gravity="0 0 -9.81"/>',
        f'<default><geom friction="{mu} 0 0" condim="3"/></default><worldbody>',
    ]
    words = lambda x: " ".join(repr(float(v)) for v in x)
    for body in bodies:
        place = f'pos="{words(body["position"])}" quat="{words(body["rotation"])}"'
        xml.append(f"<body {place}>" + ("<freejoint/>" if body["free"] else ""))
        mass = f' mass="{body["mass"]!r}"' if body["free"] else ""
        for shape in body["shapes"]:
            if "sphere" in shape:
                xml.append(f'<geom type="sphere" size="{shape["sphere"]!r}"{mass}/>')
            elif "box" in shape:
                xml.append(f'<geom type="box" size="{words(shape["box"])}"{mass}/>')
            else:
                xml.append('<geom type="plane" size="0 0 1"/>')
        xml.append("</body>")
    xml.append("</worldbody></mujoco>")
    return mujoco.MjModel.from_xml_string("".join(xml))


def main():
    folder = pathlib.Path(sys.argv[1])
    limit = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
    print(f"MuJoCo {mujoco.__version__}")
    print(f"{'scene':<14} {'solver':<8} {'steps':>6} {'contacts':>9} {'median':>9} {'deepest, mm':>12}")
    for name, mu in [("pyramid-55", 0.5), ("spheres-500", 0.4), ("spheres-1000", 0.4)]:
        bodies = json.loads((folder / f"{name}.json").read_text())
        for solver in ["Newton", "CG", "PGS"]:
            made = model(bodies, solver, mu)
            data = mujoco.MjData(made)
            taken, begun = [], time.perf_counter()
            while len(taken) < 1400 and time.perf_counter() - begun < limit:
                start = time.process_time()
                mujoco.mj_step(made, data)
                taken.append(1e3 * (time.process_time() - start))
            kept = taken[400:] or taken
            deepest = -1e3 * min((c.dist for c in data.contact[: data.ncon]), default=0.0)
            print(
                f"{name:<14} {solver:<8} {len(kept):>6} {data.ncon:>9}"
                f" {statistics.median(kept):>9.3f} {max(deepest, 0.0):>12.3f}"
            )


main()
