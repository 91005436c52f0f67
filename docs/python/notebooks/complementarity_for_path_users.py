# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     name: python3
#     display_name: Python 3
# ---

# %% [markdown]
# # Complementarity, for those who come from PATH
#
# Two firms sell the same good at the price `p = 100 − (x1 + x2)`; each chooses what it makes so that its own profit is largest. At a Nash equilibrium no
# firm gains by another choice: the first-order conditions of all at once, a mixed complementarity problem.
#
# `0 ≤ x_i ⟂ c_i'(x_i) − p(Σ x) + x_i ≥ 0`

# %%
import numpy as np

import nonsmooth as ns

cost = np.array([10.0, 40.0])


def F(x):
    return cost + x**2 / 50 - (100 - x.sum()) + x


def jacobian(x):
    return np.ones((2, 2)) + np.diag(1 + x / 25)


market = ns.MCP(F, [1.0, 1.0], jac=jacobian)
answer = ns.solve(market)
answer

# %% [markdown]
# The status is the judge's: each row of F in units of its own terms. No firm gains by deviating:

# %%
assert answer.solved


def profit(i, xi):
    x = answer.x.copy()
    x[i] = xi
    return (100 - x.sum()) * xi - cost[i] * xi - xi**3 / 150


for i in range(2):
    best = max(profit(i, xi) for xi in np.linspace(0, 100, 2001))
    print(f"firm {i + 1} makes {answer.x[i]:.3f}, profit {profit(i, answer.x[i]):.2f}; the best of others {best:.2f}")
    assert best <= profit(i, answer.x[i]) + 1e-6

# %% [markdown]
# Bounds are part of the problem: a licence for at most 20 of the first firm, and the second fills the gap.

# %%
market.update(upper=[20.0, np.inf])
limited = ns.solve(market)
print(limited.x, limited.counts)
assert limited.x[0] == 20.0 and limited.x[1] > answer.x[1]

# %% [markdown]
# Lemke's method, and what a linear problem without a solution looks like: it is proved, with vectors that anybody can check.

# %%
lcp = ns.LCP([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
print(ns.solve(lcp, "lemke").z)
none = ns.solve(ns.LCP([[-2.0, 1.0], [1.0, -2.0]], [-1.0, -1.0]))
print(none.message, none.certificate)
assert none.status is ns.Status.INFEASIBLE

# %% [markdown]
# How the equilibrium of a linear market moves with its data: derivatives of the solution.

# %%
equilibrium = ns.solve(lcp, tol=1e-12)
print(ns.derivative(lcp, equilibrium, "q").matrix())
assert np.allclose(ns.derivative(lcp, equilibrium, "q").matrix(), -np.linalg.inv([[2, 1], [1, 2]]))
