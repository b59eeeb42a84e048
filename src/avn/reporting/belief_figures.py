"""Figures of an agent's beliefs: occupancy map over time, and memory retrievals."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.navigation.trace import BeliefTrace, Trace
from avn.reporting.sound_figures import draw_plan
from avn.reporting.trajectory_figures import (
    CAPTION,
    FRONT,
    RUN_COLOURS,
    draw_place,
    draw_walk,
    extent,
    figure_of,
    marker_handles,
    outcome,
    plan_of,
    title_of,
    wrapped,
)

PANELS = 6
_STAR: dict[str, Any] = {"color": "#ffb000", "mec": "black", "mew": 0.8}
# Colour of the path, distinct from all colours of the belief.
WALKED = "#e0218a"
# Colour of what is believed about the source, and area of the dot of the likeliest square.
SOURCE = "#1f6fb2"
_LIKELIEST = 60.0
# What the dots of a posterior are, for legends.
DOTS = "where the source may be, area as the probability"


def belief_figure(trace: Trace, name: str, caption: str = "") -> Figure:
    """Draw the occupancy belief at some steps from the first to the last.

    Parameters
    ----------
    trace : Trace
        The episode.
    name : str
        Name of the run.
    caption : str
        World of the run, below the figure.

    Raises
    ------
    ValueError
        If the agent has no occupancy map or took no action.
    """
    beliefs = trace.beliefs
    if beliefs is None or beliefs.free is None or not len(trace.action):
        raise ValueError("this agent has no map of free squares")
    steps = np.unique(np.linspace(0, len(trace.action) - 1, PANELS).round().astype(int))
    figure = figure_of(11.5, 3.3 * -(-len(steps) // 3) + 1.0, caption)
    panels = figure.subplots(-(-len(steps) // 3), 3, squeeze=False).reshape(-1)
    for axes in panels[len(steps) :]:
        axes.set_visible(False)
    for axes, step in zip(panels, steps, strict=False):
        image = draw_belief(axes, trace, beliefs, int(step))
        axes.set_title(f"before action {step + 1}", fontsize=9)
    bar = figure.colorbar(image, ax=list(panels), fraction=0.025, pad=0.01)
    bar.set_label("belief that a square is free")
    figure.suptitle(wrapped(f"{name}: {title_of(trace)}; {outcome(trace)}", 110), fontsize=10)
    _legend(
        figure,
        _belief_handles(trace.source_estimates is not None, beliefs.posterior is not None),
    )
    return figure


def _legend(figure: Figure, handles: list[Line2D]) -> None:
    """Draw a legend of one line at the bottom of a figure, above its caption."""
    style: dict[str, Any] = {"handles": handles, "ncols": len(handles), "frameon": False}
    style |= {"fontsize": 9, "borderaxespad": 0.0}
    caption = figure.get_supxlabel()
    if not caption:
        figure.legend(loc="outside lower left", **style)
        return
    # the layout keeps the caption clear of the panels, and not of a legend outside of them
    room = "\n\n"
    label = figure.supxlabel(f"{room}{caption}", x=0.01, ha="left", **CAPTION)
    figure.canvas.draw()
    lines = caption.count("\n") + 1
    box = label.get_window_extent().transformed(figure.transFigure.inverted())
    top = box.y0 + box.height * lines / (lines + room.count("\n"))
    figure.legend(loc="lower left", bbox_to_anchor=(0.0, top), **style).set_in_layout(False)


def _belief_handles(estimate: bool, posterior: bool) -> list[Line2D]:
    """Return the legend of the marks on a belief."""
    ring: dict[str, Any] = {"marker": "o", "mfc": "white", "mec": WALKED, "mew": 2, "markersize": 7}
    handles = [
        Line2D([], [], color=WALKED, lw=2, label="path so far"),
        Line2D([], [], color=WALKED, lw=2, label="agent, line to its front", **ring),
        Line2D([], [], linestyle="none", marker="*", markersize=12, label="source", **_STAR),
    ]
    if estimate:
        cross: dict[str, Any] = {"marker": "P", "color": SOURCE, "mec": "white", "markersize": 9}
        handles.append(Line2D([], [], linestyle="none", label="source estimate", **cross))
    if posterior:
        dot: dict[str, Any] = {"marker": "o", "color": SOURCE, "mew": 0, "markersize": 6}
        handles.append(Line2D([], [], linestyle="none", label=DOTS, **dot))
    return handles


def draw_belief(axes: Axes, trace: Trace, beliefs: BeliefTrace, step: int) -> Any:
    """Draw the occupancy belief at one step, with the walls and the path so far.

    Parameters
    ----------
    axes : Axes
    trace : Trace
    beliefs : BeliefTrace
        With an occupancy belief, `free`.
    step : int

    Returns
    -------
    AxesImage
        The belief.
    """
    assert beliefs.free is not None
    free = beliefs.free[step]
    image = axes.imshow(
        free / 255.0,
        origin="lower",
        extent=extent(beliefs.low, free.shape),
        cmap="BrBG",
        vmin=0,
        vmax=1,
        zorder=0,
    )
    if (plan := plan_of(trace)) is not None:
        draw_plan(axes, plan)
        for patch in axes.patches:  # furniture, which would hide the belief
            if patch.get_zorder() == 0:
                patch.set_visible(False)
    if beliefs.posterior is not None:
        draw_posterior(axes, beliefs, step)
    path = trace.path[: step + 1]
    axes.plot(*path.T, color=WALKED, lw=2, zorder=5)
    front = FRONT[trace.state[step] % HEADINGS]
    axes.plot(*np.stack((path[-1], path[-1] + 0.4 * front)).T, color=WALKED, lw=2, zorder=5)
    axes.plot(*path[-1], "o", color="white", mec=WALKED, mew=2, markersize=7, zorder=6)
    if trace.source_estimates is not None:
        axes.plot(
            *trace.source_estimates[step], "P", color=SOURCE, mec="white", markersize=9, zorder=7
        )
    axes.plot(
        *trace.goals[step], "*", color="#ffb000", mec="black", mew=0.8, markersize=12, zorder=7
    )
    left, right, bottom, top = extent(beliefs.low, free.shape)
    axes.set(xlim=(left, right), ylim=(bottom, top), xticks=[], yticks=[], xlabel="", ylabel="")
    return image


def draw_posterior(axes: Axes, beliefs: BeliefTrace, step: int) -> PathCollection:
    """Draw the posterior of the source at one step, as dots on the squares.

    Parameters
    ----------
    axes : Axes
    beliefs : BeliefTrace
        With a posterior.
    step : int

    Returns
    -------
    PathCollection
        The dots of all squares, by y and x. Their areas are as `posterior_areas` gives them.
    """
    assert beliefs.posterior is not None
    height, width = beliefs.posterior.shape[1:]
    x, y = np.meshgrid(
        *(CELL * (low + np.arange(n)) for low, n in zip(beliefs.low, (width, height), strict=True))
    )
    areas = posterior_areas(beliefs, step)
    return axes.scatter(x.ravel(), y.ravel(), s=areas, color=SOURCE, linewidths=0, zorder=6)


def posterior_areas(beliefs: BeliefTrace, step: int) -> NDArray[np.float64]:
    """Return the area of the dot of each square in points squared, as its probability."""
    assert beliefs.posterior is not None
    return _LIKELIEST * beliefs.posterior[step].ravel() / 255.0


def memory_figure(trace: Trace, name: str, caption: str = "") -> Figure:
    """Draw the exploration walk in an agent's memory, its retrievals, and their errors.

    Parameters
    ----------
    trace : Trace
        The episode.
    name : str
        Name of the run.
    caption : str
        World of the run, below the figure.

    Raises
    ------
    ValueError
        If the agent has no memory.
    """
    beliefs = trace.beliefs
    if beliefs is None or beliefs.retrieved is None or beliefs.similarity is None:
        raise ValueError("this agent has no memory")
    figure = figure_of(11.5, 6.6, caption)
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1))
    draw_place(left, trace)
    if trace.exploration_trajectory is not None:
        walk = trace.scene.grid.centres[trace.exploration_trajectory // HEADINGS]
        left.plot(*walk.T, color="#9a9a9a", lw=1.0, zorder=6, label="exploration walk")
    draw_walk(left, trace, RUN_COLOURS[1], wrapped(f"{name}: {outcome(trace)}"))
    here, best = trace.path[:-1], beliefs.retrieved[:, 0]
    sure = np.clip((beliefs.similarity[:, 0] - 0.9) / 0.1, 0.08, 1)
    for place, entry, weight in zip(here, best, sure, strict=True):
        line = np.stack((place, entry[:2]))
        left.plot(*line.T, color=RUN_COLOURS[0], lw=1.2, alpha=float(weight), zorder=8)
    left.plot(
        *best[:, :2].T,
        ".",
        color=RUN_COLOURS[0],
        markersize=6,
        zorder=9,
        label="most similar entry",
    )
    left.set_title(title_of(trace), fontsize=10)
    lines: dict[str, Any] = {
        "color": RUN_COLOURS[0],
        "lw": 1.2,
        "label": "from the agent to that entry",
    }
    handles = [
        *left.get_legend_handles_labels()[0],
        Line2D([], [], **lines),
        *marker_handles(trace),
    ]
    left.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0, 0), frameon=False, fontsize=8, ncols=2
    )
    off = np.linalg.norm(best[:, :2] - here, axis=1)
    right.plot(off, color=RUN_COLOURS[0], label="position error of the most similar entry")
    lost = np.linalg.norm(beliefs.pose[:, :2] - here, axis=1)
    right.plot(lost, color="#222222", ls="--", label="error of the estimated pose")
    right.set(xlabel="action", ylabel="metres", ylim=(-0.1, max(1.0, off.max(), lost.max()) * 1.3))
    cosine = right.twinx()
    cosine.plot(beliefs.similarity[:, 0], color="#3a9a5b", lw=1, label="cosine similarity")
    cosine.set(ylabel="cosine similarity of the most similar entry", ylim=(0, 1.02))
    handles = [*right.get_lines(), *cosine.get_lines()]
    right.legend(
        handles=handles, frameon=False, fontsize=9, loc="lower left", bbox_to_anchor=(0, 1)
    )
    return figure
