"""Compares imported models with MuJoCo: python compare_mujoco.py NONSMOOTH MODEL.xml ... [needs the package mujoco]

Of each model the bodies of the scene that `NONSMOOTH convert` makes are compared with those that MuJoCo compiles, where it stands in its first keyframe, or else at
its reference: mass, mass centre and inertia in the frame of the world, of all bodies that are one together. Exits 1 where a difference is above the tolerance,
relative to the size of the body.
"""

import pathlib
import subprocess
import sys
import tomllib

import mujoco
import numpy as np

# Vertices of meshes have single precision there.
TOLERANCE = 1e-7


def matrix(q):
    out = np.zeros(9)
    mujoco.mju_quat2Mat(out, np.array(q, dtype=float))
    return out.reshape(3, 3)


def theirs(path):
    """Mass, mass centre, inertia of each body that moves, with all that does not move against it; by its name or number."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    found = {}
    for carrier in range(1, model.nbody):
        if model.body_weldid[carrier] != carrier:
            continue
        members = [k for k in range(model.nbody) if model.body_weldid[k] == carrier]
        mass = sum(model.body_mass[k] for k in members)
        centre = sum(model.body_mass[k] * data.xipos[k] for k in members) / mass
        inertia = np.zeros((3, 3))
        for k in members:
            r = data.ximat[k].reshape(3, 3)
            d = data.xipos[k] - centre
            inertia += r @ np.diag(model.body_inertia[k]) @ r.T
            inertia += model.body_mass[k] * (d @ d * np.eye(3) - np.outer(d, d))
        name = model.body(carrier).name or f"body {carrier}"
        found[name] = (mass, centre, inertia, data.xpos[carrier], data.xmat[carrier].reshape(3, 3))
    return found


def ours(program, path):
    made = subprocess.run([program, "convert", path, "-"], capture_output=True, text=True)
    if made.returncode:
        sys.exit(made.stderr.strip())
    found = {}
    for body in tomllib.loads(made.stdout)["bodies"]:
        if body.get("fixed"):
            continue
        r = matrix(body["rotation"]["quaternion"])
        xx, yy, zz, xy, xz, yz = body["inertia"]
        j = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        found[body["name"]] = (body["mass"], np.array(body["position"]), r @ j @ r.T, r)
    return found


def main(program, paths):
    worst = 0.0
    for path in map(pathlib.Path, paths):
        a, b = theirs(path), ours(program, path)
        if a.keys() != b.keys():
            sys.exit(f"{path}: MuJoCo has the bodies {sorted(a)}, the scene {sorted(b)}")
        off = 0.0
        for name, (mass, centre, inertia, _, axes) in a.items():
            m, x, j, r = b[name]
            size = max(1.0, np.abs(centre).max())
            off = max(
                off,
                abs(m - mass) / mass,
                np.abs(x - centre).max() / size,
                np.abs(j - inertia).max() / np.abs(inertia).max(),
                np.abs(r - axes).max(),
            )
        print(f"{path.name}: {len(a)} bodies, largest difference {off:.1e}")
        worst = max(worst, off)
    sys.exit(int(worst > TOLERANCE))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
