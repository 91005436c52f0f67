# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     name: python3
#     display_name: Python 3
# ---

# %% [markdown]
# # An arch on the point of falling
#
# Stones that only touch: how much friction does an arch need to stand? The contact problem of one step says it, for the stones at rest are a solution of it or not.

# %%
import pathlib

import numpy as np

import nonsmooth as ns

here = pathlib.Path.cwd()
examples = next(p / "examples" for p in (here, *here.parents) if (p / "examples" / "arch.hdf5").exists())
arch = ns.read(examples / "arch.hdf5")
mu = arch.mu[0]
print(f"{arch!r}, mu = {mu}")

# %%
answer = ns.solve(arch).raise_if_unsolved()
answer.plot()

# %% [markdown]
# With less and less friction there comes a value below which something moves.


# %%
def moves(mu):
    arch.update(mu=mu)
    answer = ns.solve(arch, tol=1e-8)
    return np.abs(answer.v).max() if answer.solved else np.inf


stands, falls = mu, 0.0
assert moves(stands) < 1e-6 < moves(falls)
for _ in range(12):
    middle = (stands + falls) / 2
    stands, falls = (middle, falls) if moves(middle) < 1e-6 else (stands, middle)
print(f"it stands with mu = {stands:.4f} and not with {falls:.4f}")

# %% [markdown]
# And in motion: the same family of stones, with and without that friction.

# %%
world = ns.World(name="arch")
world.generate("arch")
standing = ns.simulate(world, until=0.2, h=2e-3, every=10)
assert standing.solved
print(standing, np.linalg.norm(standing.position[-1] - standing.position[0], axis=-1).max())

# %%
slippery = world.copy()
slippery.pair("arch", mu=0.05)
falling = ns.simulate(slippery, until=0.2, h=2e-3, every=10)
print(falling, np.linalg.norm(falling.position[-1] - falling.position[0], axis=-1).max())

# %%
falling
