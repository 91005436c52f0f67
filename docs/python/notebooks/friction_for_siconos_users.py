# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     name: python3
#     display_name: Python 3
# ---

# %% [markdown]
# # Friction, for those who come from Siconos
#
# | Siconos | here |
# | --- | --- |
# | `FrictionContactProblem(3, nc, W, q, mu)` | `ns.Friction(W=W, q=q, mu=mu)` |
# | `SolverOptions(SICONOS_FRICTION_3D_NSGS)`, `iparam`, `dparam` | `ns.Nsgs(omega=0.9, freeze_after=10)` |
# | `fc3d_driver(problem, reaction, velocity, options)` | `answer = ns.solve(problem, ...)` |
# | `info == 0` | `answer.status`, which a judge decides |
# | `options.dparam[SICONOS_DPARAM_RESIDU]` | `answer.residuals["siconos"]`, and three other residuals |

# %%
import pathlib

import numpy as np

import nonsmooth as ns

here = pathlib.Path.cwd()
examples = next(p / "examples" for p in (here, *here.parents) if (p / "examples" / "wall.hdf5").exists())
wall = ns.read(examples / "wall.hdf5")
wall

# %% [markdown]
# FCLIB's files are read as they are. The parts have FCLIB's letters.

# %%
print(wall.mu[:5], wall.H.shape if "H" in dir(wall) else wall.W.shape)
wall.spy()

# %%
nsgs = ns.solve(wall, ns.Nsgs(), tol=1e-4, time_limit=20)
auto = ns.solve(wall, tol=1e-8)
for answer in (nsgs, auto):
    print(answer, {name: f"{answer.residuals[name]:.1e}" for name in ("relative", "siconos", "literature")})
assert auto.solved

# %% [markdown]
# An error as Siconos defines it is small where impulses are large numbers, whatever the velocities are; the relative residual is a pure number and decides.

# %%
auto.plot()

# %%
contacts = auto.contacts
print({status: int((contacts["status"] == status).sum()) for status in ("open", "stick", "stick at limit", "slip")})
contacts[:3]

# %% [markdown]
# What Siconos leaves to the last digit of an option array is a typed setting with a range, and slips are answered.

# %%
try:
    ns.Nsgs(omga=0.9)
except ns.Error as error:
    print(error)

# %%
runs = ns.bench({"wall": wall}, ["auto", "nsgs"], tol=1e-4, repeats=0, time_limit=20)
runs.to_pandas()[["solver", "ending", "iterations", "seconds", "relative"]]
