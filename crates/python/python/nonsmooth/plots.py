"""Pictures, with matplotlib where it is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from ._nonsmooth import Error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .answers import Answer
    from .comparing import Profile
    from .problems import Problem
    from .simulation import Run


def _pyplot() -> Any:
    try:
        import matplotlib.pyplot as pyplot
    except ImportError as e:
        raise Error("plots: expected matplotlib, found none: pip install matplotlib") from e
    return pyplot


def _axes(ax: Optional[Axes]) -> Axes:
    # With room for a legend beside the axes.
    made: Axes = ax if ax is not None else _pyplot().subplots(layout="constrained")[1]
    return made


def spy(problem: Problem, ax: Optional[Axes] = None) -> Axes:
    """Where the entries of the first matrix of a problem are."""
    axes = _axes(ax)
    for letter, part in problem.parts.items():
        if getattr(part, "ndim", 0) == 2:
            axes.spy(part, markersize=max(0.5, 200 / max(part.shape)))
            axes.set_title(f"{letter}, {part.shape[0]} × {part.shape[1]}")
            return axes
    raise Error(f"spy: expected a problem with a matrix, found one {problem.kind}")


def history(answer: Answer, ax: Optional[Axes] = None) -> Axes:
    """The relative residual by iterations."""
    axes = _axes(ax)
    rows = answer.history
    axes.semilogy(rows["iteration"], rows["residual"], ".-")
    axes.set_xlabel("iteration")
    axes.set_ylabel("relative residual")
    return axes


def _tangential(table: Any, letter: str) -> Any:
    names = [name for name in table.dtype.names if name.startswith(f"{letter}_t")]
    return np.sqrt(sum(np.asarray(table[name]) ** 2 for name in names))


FEW = 8
"""As many curves are named within the axes, more beside them."""
COLUMN = 36
"""As many names stand below each other."""
COLOURS = {
    "open": "tab:gray",
    "stick": "tab:blue",
    "stick at limit": "tab:cyan",
    "slip": "tab:red",
    "roll": "tab:green",
    "slip and roll": "tab:orange",
}
"""What contacts do, by colours."""


def cone(answer: Answer, ax: Optional[Axes] = None) -> Axes:
    """Each contact's ``‖r_T‖ / mu`` by ``r_N``, below the line of the cone."""
    axes = _axes(ax)
    table = answer.contacts
    n, t = np.asarray(table["r_n"]), _tangential(table, "r")
    mu = np.asarray(table["mu"])
    size = np.divide(t, mu, out=np.zeros_like(t), where=mu > 0)
    statuses = np.asarray(table["status"])
    # What has no colour of its own is drawn all the same.
    others = {str(status): "black" for status in np.unique(statuses) if status not in COLOURS}
    for status, colour in {**COLOURS, **others}.items():
        of = statuses == status
        if of.any():
            axes.plot(n[of], size[of], ".", color=colour, label=f"{status} ({of.sum()})")
    most = float(n.max(initial=0.0))
    axes.plot([0, most], [0, most], "k-", lw=0.8)
    axes.set_xlabel("$r_N$ (N s)")
    axes.set_ylabel("$|r_T|/\\mu$ (N s)")
    axes.legend()
    return axes


def impulses(answer: Answer, ax: Optional[Axes] = None) -> Axes:
    """Normal and tangential impulses, contact by contact."""
    axes = _axes(ax)
    table = answer.contacts
    which = np.arange(len(table))
    axes.bar(which, np.asarray(table["r_n"]), label="$r_N$")
    axes.bar(which, -_tangential(table, "r"), label="$-|r_T|$")
    axes.set_xlabel("contact")
    axes.set_ylabel("impulse (N s)")
    axes.legend()
    return axes


def plot(answer: Answer) -> Figure:
    """The history of the residual and, of contacts, impulses and cone."""
    with_contacts = "friction" in answer._native.kind
    panels = [history, impulses, cone] if with_contacts else [history]
    figure, axes = _pyplot().subplots(1, len(panels), figsize=(4 * len(panels), 3.2), squeeze=False)
    for panel, ax in zip(panels, axes[0]):
        panel(answer, ax)
    figure.suptitle(f"{answer.status}, residual {answer.residual:.1e}")
    figure.tight_layout()
    made: Figure = figure
    return made


def energies(run: Run, ax: Optional[Axes] = None) -> Axes:
    """Kinetic and potential energy and their sum, by time."""
    axes = _axes(ax)
    t, energy = run.steps["time"], run.energy
    axes.plot(t, energy["kinetic"], label="kinetic")
    axes.plot(t, energy["potential"], label="potential")
    axes.plot(t, energy["kinetic"] + energy["potential"], "k-", lw=0.8, label="sum")
    axes.set_xlabel("t (s)")
    axes.set_ylabel("energy (J)")
    axes.legend()
    return axes


def profiles(profile: Profile, ax: Optional[Axes] = None) -> Axes:
    """Performance profiles: the share of problems by how many times the cost of the best a solver took."""
    axes = _axes(ax)
    most = max((steps[-1][0] for steps in profile.curves.values() if steps), default=1.0)
    for k, (solver, steps) in enumerate(profile.curves.items()):
        x, y = zip(*[(1.0, 0.0), *steps])
        # Colours come again after ten.
        style = ("-", "--", ":", "-.")[k // 10 % 4]
        axes.step([*x, 1.1 * most], [*y, y[-1]], style, where="post", label=solver)
    axes.set_xscale("log")
    axes.set_ylim(0, 1.02)
    axes.set_xlabel(f"{profile.cost} over those of the best")
    axes.set_ylabel("share of problems solved")
    many = len(profile.curves)
    if many > FEW:
        # They would hide the curves.
        columns = -(-many // COLUMN)
        axes.legend(
            loc="upper left",
            bbox_to_anchor=(1.02, 1.0),
            borderaxespad=0.0,
            fontsize="xx-small",
            ncols=columns,
        )
        if ax is None:
            figure: Any = axes.get_figure()
            figure.set_figwidth(figure.get_figwidth() + 2.5 * columns)
    else:
        axes.legend()
    return axes
