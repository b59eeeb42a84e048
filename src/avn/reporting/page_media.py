"""Episode media of the report page: plans, paths, views, beliefs and sound as JSON."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
import soundfile
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.trace import Trace
from avn.reporting.trajectory_figures import draw_apartment, outcome, title_of

# Margin around the outermost cells in the image of a plan, metres.
_ROUND = 1.0
_PIXELS_A_METRE = 60
_JPEG_QUALITY = 72


def data_url(kind: str, content: bytes) -> str:
    """Encode a file as a data URL, such as `data:image/png;base64,...`."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def figure_url(figure: Figure) -> str:
    """Encode a figure as the data URL of a PNG with a palette of 128 colours."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    with Image.open(buffer) as image:
        small = io.BytesIO()
        image.convert("RGB").quantize(128, dither=Image.Dither.NONE).save(small, "PNG")
    return data_url("image/png", small.getvalue())


def scene_plan(scene: NavigationScene) -> dict[str, Any]:
    """Return the floor plan image of an apartment, its bounds and its cell centres in metres."""
    low, high = scene.grid.centres.min(axis=0) - _ROUND, scene.grid.centres.max(axis=0) + _ROUND
    width, height = (high - low).tolist()
    figure = Figure(figsize=(width, height), dpi=_PIXELS_A_METRE)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    draw_apartment(axes, scene)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    bounds = {"left": float(low[0]), "top": float(high[1]), "width": width, "height": height}
    return {"image": figure_url(figure), "cells": _rounded(scene.grid.centres), **bounds}


def view_url(view: NDArray[np.uint8]) -> str:
    """Encode a view (H, W, 3) as the data URL of a JPEG."""
    buffer = io.BytesIO()
    Image.fromarray(view).save(buffer, "JPEG", quality=_JPEG_QUALITY)
    return data_url("image/jpeg", buffer.getvalue())


def sound_url(track: NDArray[np.float32], rate: int) -> str:
    """Encode a stereo track (n, 2), at a rate in Hz, as the data URL of an Ogg Vorbis file."""
    buffer = io.BytesIO()
    with soundfile.SoundFile(buffer, "w", rate, 2, format="OGG", subtype="VORBIS") as file:
        for start in range(0, len(track), rate):  # libsndfile crashes on minutes at once
            file.write(track[start : start + rate])
    return data_url("audio/ogg", buffer.getvalue())


def episode_media(trace: Trace, track: NDArray[np.float32], rate: int) -> dict[str, Any]:
    """Return the data of an episode by step, without its views, as JSON values.

    Parameters
    ----------
    trace : Trace
        The episode.
    track : (n, 2) float32
        Its soundtrack, left and right.
    rate : int
        Sampling rate of the soundtrack in Hz.
    """
    heading = (trace.state % HEADINGS)[:, None]
    return {
        "title": title_of(trace),
        "outcome": outcome(trace),
        "goals": _rounded(trace.goals),
        "path": _rounded(np.concatenate((trace.path, heading), axis=1)),
        "action": trace.action.tolist(),
        "collided": trace.collided.astype(int).tolist(),
        "source_estimates": None
        if trace.source_estimates is None
        else _rounded(trace.source_estimates),
        "belief": _belief(trace),
        "memory": _memory(trace),
        "sound": sound_url(track, rate),
    }


def _belief(trace: Trace) -> dict[str, Any] | None:
    beliefs = trace.beliefs
    if beliefs is None or beliefs.free is None or not len(trace.action):
        return None
    height, width = beliefs.free.shape[1:]
    left, bottom = (beliefs.low - 0.5) * CELL
    return {
        "left": float(left),
        "top": float(bottom + CELL * height),
        "width": width,
        "height": height,
        "free": base64.b64encode(beliefs.free.tobytes()).decode("ascii"),
    }


def _memory(trace: Trace) -> dict[str, Any] | None:
    """Return the exploration walk in an agent's memory and the retrieved positions."""
    beliefs = trace.beliefs
    if beliefs is None or beliefs.retrieved is None or trace.exploration_trajectory is None:
        return None
    walk = trace.scene.grid.centres[trace.exploration_trajectory // HEADINGS]
    return {"walk": _rounded(walk), "entries": _rounded(beliefs.retrieved[..., :2])}


def _rounded(values: NDArray[np.float64]) -> list[Any]:
    found: list[Any] = np.round(np.asarray(values, dtype=np.float64), 2).tolist()
    return found
