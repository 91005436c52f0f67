"""An arch of stones: read its contact problem, solve it by two methods, look at where it is near to slipping, and let it stand.

    python examples/python/arch.py
"""

from __future__ import annotations

import pathlib

import numpy as np

import nonsmooth as ns

arch = ns.read(pathlib.Path(__file__).parents[1] / "arch.hdf5")
print(repr(arch))

answer = ns.solve(arch).raise_if_unsolved()
print(repr(answer))
for line in answer.account:
    print(f"  {line}")

# By another method, from there; the status is the judge's either way.
again = ns.solve(arch, ns.Nsgs(omega=0.9), tol=1e-6, warm_start=answer, time_limit=10.0)
print(f"nsgs: {again.status}, {again.iterations} sweeps")

# How much of the friction is used, joint by joint.
contacts = answer.contacts
pressed = contacts[contacts["r_n"] > 0]
used = np.hypot(pressed["r_t1"], pressed["r_t2"]) / (pressed["mu"] * pressed["r_n"])
print(f"{len(pressed)} contacts carry; at most {used.max():.0%} of their friction is used")

# With less friction it slides down: the same problem, one part of it changed.
slippery = ns.read(pathlib.Path(__file__).parents[1] / "arch.hdf5")
slippery.update(mu=0.1)
fallen = ns.solve(slippery)
print(f"with mu = 0.1: {fallen.status}, {fallen.counts}")

# The same arch in motion: a tenth of a second under its weight.
world = ns.World(name="arch")
world.generate("arch")
run = ns.simulate(world, until=0.1, h=1e-3)
moved = np.linalg.norm(run.position[-1] - run.position[0], axis=-1).max()
print(f"{run!r}; no stone moved by more than {moved:.1e} m")
assert answer.solved and run.solved and moved < 1e-3
