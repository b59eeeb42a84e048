"""Figures of trajectories on the floor plan, as in figure 4 of the paper, and source estimates."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL, FloorPlan
from avn.core.actions import HEADINGS
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.trace import Trace
from avn.reporting.floor_plan_figure import draw_floor_plan

# Colours of compared runs, distinguishable with colour vision deficiency.
RUN_COLOURS = ("#d1495b", "#1f6fb2", "#3a9a5b", "#8a5fbf", "#c98a1b", "#4d4d4d")
# Style of the source's star.
_SOURCE: dict[str, Any] = {"color": "#ffb000", "mec": "black", "mew": 0.8, "markersize": 15}
# Style of the distractor's diamond.
DISTRACTOR: dict[str, Any] = {"color": "0.6", "mec": "black", "mew": 0.8, "markersize": 10}
FRONT = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])
# Text of captions.
CAPTION: dict[str, Any] = {"fontsize": 8, "color": "0.35"}


def plan_of(trace: Trace) -> FloorPlan | None:
    """Return the floor plan of a trace's apartment; None if it was drawn as text."""
    return getattr(trace.scene, "plan", None)


def draw_place(axes: Axes, trace: Trace) -> None:
    """Draw a trace's apartment in faint colours, the source at the end, and a distractor."""
    draw_apartment(axes, trace.scene)
    if trace.distractor is not None:
        axes.plot(*trace.distractor, "D", zorder=12, **DISTRACTOR)
    if (trace.goals != trace.goal).any():
        axes.plot(*trace.goals.T, ":", color="#c98a1b", lw=1.5, zorder=6)
    axes.plot(*trace.goals[-1], "*", zorder=12, **_SOURCE)


def draw_apartment(axes: Axes, scene: NavigationScene) -> None:
    """Draw an apartment in faint colours, in metres: its floor plan, or its cells without one."""
    plan: FloorPlan | None = getattr(scene, "plan", None)
    if plan is None:
        for x, y in scene.grid.centres:
            corner = (x - CELL / 2, y - CELL / 2)
            axes.add_patch(Rectangle(corner, CELL, CELL, color="#f2efe8", zorder=0))
        axes.set_aspect("equal")
        axes.autoscale_view()
    else:
        draw_floor_plan(axes, plan, scene.grid)
        for line in list(axes.lines):  # cells, edges and sources would hide the paths
            line.remove()
        for text in list(axes.texts):
            text.remove()
        for patch in axes.patches:
            if patch.get_zorder() == 3:  # walls, which overlap
                patch.set_facecolor("#8d8d8d")
            else:
                patch.set_alpha(0.55)
    axes.set(title="", xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)


def draw_walk(
    axes: Axes, trace: Trace, colour: str, label: str | None = None, shift: float = 0.0
) -> None:
    """Draw the path of an episode with its start, end, collisions and initial heading.

    Parameters
    ----------
    axes : Axes
    trace : Trace
    colour : str
    label : str, optional
        Label in the legend.
    shift : float
        Shift to the north-east in metres, which keeps overlapping paths visible.
    """
    path = trace.path + shift
    axes.plot(*path.T, color=colour, linewidth=2.2, alpha=0.9, zorder=9, label=label)
    moved = np.flatnonzero(np.any(np.diff(path, axis=0) != 0, axis=1))
    for at in moved[len(moved) > 6 :: 4]:
        middle, way = path[at : at + 2].mean(axis=0), path[at + 1] - path[at]
        style: dict[str, Any] = {"arrowstyle": "-|>", "color": colour, "lw": 0}
        style["mutation_scale"] = 14
        axes.annotate("", middle + 0.18 * way, middle - 0.18 * way, arrowprops=style, zorder=10)
    bumps = path[trace.collided]
    axes.plot(*bumps.T, "x", color=colour, markersize=5, mew=1.2, zorder=10)
    front = FRONT[trace.state[0] % HEADINGS]
    axes.plot(*np.stack((path[0], path[0] + 0.32 * front)).T, color=colour, lw=2.2, zorder=10)
    axes.plot(*path[0], "o", color="white", mec=colour, mew=2, markersize=8, zorder=11)
    if trace.record["success"]:
        axes.plot(*path[-1], "s", color=colour, mec="white", markersize=8, zorder=11)
    else:
        axes.plot(*path[-1], "X", color=colour, mec="white", markersize=10, zorder=11)


def marker_handles(trace: Trace) -> list[Line2D]:
    """Return the legend of the markers of `draw_walk` and `draw_place` for a trace, in grey."""
    grey: dict[str, Any] = {"color": "0.4", "linestyle": "none"}
    handles = [
        Line2D([], [], marker="o", mfc="white", mew=2, markersize=8, label="start", **grey),
        Line2D([], [], marker="s", markersize=8, label="end, success", **grey),
        Line2D([], [], marker="X", markersize=10, mec="white", label="end, failure", **grey),
        Line2D([], [], marker="x", markersize=5, label="collision", **grey),
        Line2D([], [], marker="*", label="source", **(grey | _SOURCE)),
    ]
    if trace.distractor is not None:
        handles.append(Line2D([], [], marker="D", label="distractor", **(grey | DISTRACTOR)))
    return handles


def wrapped(text: str, letters: int = 62) -> str:
    """Break a long label into lines, so that it does not run out of the figure."""
    return "\n".join(textwrap.wrap(text, letters)) or text


def trajectory_figure(
    episodes: Sequence[Sequence[Trace]], names: Sequence[str], caption: str = ""
) -> Figure:
    """Draw the trajectories of several runs in the same episodes.

    Parameters
    ----------
    episodes : sequence of sequences of Trace
        By episode and run.
    names : sequence of str
        Names of the runs.
    caption : str
        World of the runs, below the figure.

    Returns
    -------
    Figure
        A panel for each episode: ring at the start, square at a successful end, cross at a failed
        one, small crosses at collisions, star at the source, diamond at the distractor.
    """
    columns = min(2, len(episodes))
    rows = -(-len(episodes) // columns)
    figure = figure_of(6.2 * columns, (5.4 + 0.3 * len(names)) * rows + 0.5, caption)
    panels = figure.subplots(rows, columns, squeeze=False).reshape(-1)
    for axes in panels[len(episodes) :]:
        axes.set_visible(False)
    for axes, runs in zip(panels, episodes, strict=False):
        draw_place(axes, runs[0])
        for index, (trace, name) in enumerate(zip(runs, names, strict=True)):
            shift = 0.06 * (index - (len(runs) - 1) / 2)
            colour = RUN_COLOURS[index % len(RUN_COLOURS)]
            draw_walk(axes, trace, colour, wrapped(f"{name}: {outcome(trace)}"), shift)
        axes.set_title(title_of(runs[0]), fontsize=11)
        axes.legend(
            loc="upper left", bbox_to_anchor=(0, 0), frameon=False, fontsize=9, borderaxespad=0.2
        )
    _add_markers(figure, 5 if columns > 1 else 3, episodes[0][0])
    return figure


def _add_markers(figure: Figure, columns: int, trace: Trace) -> None:
    """Add the legend of the markers above all panels."""
    handles = marker_handles(trace)
    figure.legend(
        handles=handles, loc="outside upper left", ncols=columns, frameon=False, fontsize=9
    )


def estimate_figure(trace: Trace, name: str, caption: str = "") -> Figure:
    """Draw the source estimate of each step and its error.

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
        If the agent has no source estimates.
    """
    if trace.source_estimates is None:
        raise ValueError("this agent has no source estimates")
    figure = figure_of(11.5, 6.2, caption)
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1))
    draw_place(left, trace)
    draw_walk(left, trace, "#777777")
    _add_markers(figure, 5, trace)
    steps = np.arange(len(trace.source_estimates))
    style: dict[str, Any] = {"c": steps, "cmap": "viridis", "zorder": 8}
    lines = np.stack((trace.path, trace.source_estimates), axis=1)
    for line, step in zip(lines, steps, strict=True):
        left.plot(*line.T, color=cmap(step / max(1, len(steps) - 1)), lw=0.5, alpha=0.5, zorder=7)
    dots = left.scatter(*trace.source_estimates.T, s=34, edgecolor="white", linewidth=0.5, **style)
    bar = figure.colorbar(dots, ax=left, orientation="horizontal", fraction=0.04, pad=0.02)
    bar.set_label("step of the source estimate (dots, with a line from the agent)")
    left.set_title(f"{wrapped(name)}\n{title_of(trace)}; {outcome(trace)}", fontsize=9)
    (x0, x1), (y0, y1) = left.get_xlim(), left.get_ylim()  # some estimates are outside
    (low_x, low_y), (high_x, high_y) = (
        trace.source_estimates.min(0) - 0.3,
        trace.source_estimates.max(0) + 0.3,
    )
    left.set_xlim(max(min(x0, low_x), x0 - 2), min(max(x1, high_x), x1 + 2))
    left.set_ylim(max(min(y0, low_y), y0 - 2), min(max(y1, high_y), y1 + 2))
    error = np.linalg.norm(trace.source_estimates - trace.goals, axis=1)
    away = np.linalg.norm(trace.path - trace.goals, axis=1)
    right.plot(steps, error, color="#1f6fb2", label="error of the source estimate")
    right.plot(steps, away, color="#777777", ls="--", label="distance from agent to source")
    right.set(xlabel="action", ylabel="metres", ylim=(0, None), xlim=(0, max(1, len(steps) - 1)))
    right.grid(alpha=0.3)
    right.legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), fontsize=9)
    return figure


def cmap(share: float) -> tuple[float, float, float, float]:
    """Return the RGBA colour of a step by its share of the episode, 0 to 1."""
    from matplotlib import colormaps

    colour: tuple[float, float, float, float] = colormaps["viridis"](share)
    return colour


def title_of(trace: Trace) -> str:
    """Describe the episode of a trace: scene, sound, number and start."""
    record = trace.record
    sight = "in sight" if record["in_sight"] else "out of sight"
    return (
        f"{record['scene']}, {record['sound']}, episode {record['episode']}: "
        f"source {record['geodesic']:.1f} m away, {sight}"
    )


def outcome(trace: Trace) -> str:
    """Describe the outcome of an episode: result, SPL and number of actions."""
    word = str(trace.record["outcome"]).replace("_", " ")
    # a Stop near both sources is a success
    if trace.record.get("stopped_at_distractor") and not trace.record["success"]:
        word = "stopped at the distractor"
    return f"{word}, SPL {trace.record['spl']:.2f}, {len(trace.action)} actions"


def figure_of(width: float, height: float, caption: str = "") -> Figure:
    """Create an empty figure without a display.

    Parameters
    ----------
    width, height : float
        Size in inches.
    caption : str
        Lines below the figure.
    """
    figure = Figure(figsize=(width, height), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    if caption:
        wide = int(15 * width)  # letters of this size in the width
        lines = [part for line in caption.splitlines() for part in textwrap.wrap(line, wide)]
        figure.supxlabel("\n".join(lines), x=0.01, ha="left", **CAPTION)
    return figure


def extent(low: NDArray[np.int64], shape: tuple[int, ...]) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top in metres of an array of squares.

    `low` is the lattice index (x, y) of the first square, `shape` the array's (H, W).
    """
    x, y = (low - 0.5) * CELL
    return (x, x + shape[1] * CELL, y, y + shape[0] * CELL)
