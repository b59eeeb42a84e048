"""What a page embeds of episodes: floor plans, paths, views, beliefs and sound, as text."""

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
from avn.navigation.place import Place
from avn.navigation.trace import Trace
from avn.reporting.trajectory_figures import draw_apartment, outcome, title_of

# Metres round the outermost cells that the picture of a plan shows.
_ROUND = 1.0
_PIXELS_A_METRE = 60
_JPEG_QUALITY = 72


def data_url(kind: str, content: bytes) -> str:
    """A file as an address that holds it, such as `data:image/png;base64,...`."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def figure_url(figure: Figure) -> str:
    """A figure as a PNG of few colours."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    with Image.open(buffer) as image:
        small = io.BytesIO()
        image.convert("RGB").quantize(128, dither=Image.Dither.NONE).save(small, "PNG")
    return data_url("image/png", small.getvalue())


def plan_of_place(place: Place) -> dict[str, Any]:
    """The picture of an apartment from above, where it lies and its cells, all in metres."""
    low, high = place.grid.centres.min(axis=0) - _ROUND, place.grid.centres.max(axis=0) + _ROUND
    width, height = (high - low).tolist()
    figure = Figure(figsize=(width, height), dpi=_PIXELS_A_METRE)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    draw_apartment(axes, place)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    place_ = {"left": float(low[0]), "top": float(high[1]), "width": width, "height": height}
    return {"image": figure_url(figure), "cells": _rounded(place.grid.centres), **place_}


def view_url(view: NDArray[np.uint8]) -> str:
    """A view (H, W, 3) as a JPEG."""
    buffer = io.BytesIO()
    Image.fromarray(view).save(buffer, "JPEG", quality=_JPEG_QUALITY)
    return data_url("image/jpeg", buffer.getvalue())


def sound_url(track: NDArray[np.float32], rate: int) -> str:
    """A track (n, 2) of a sampling rate in Hz as Ogg Vorbis."""
    buffer = io.BytesIO()
    with soundfile.SoundFile(buffer, "w", rate, 2, format="OGG", subtype="VORBIS") as file:
        for start in range(0, len(track), rate):  # libsndfile crashes on minutes at once
            file.write(track[start : start + rate])
    return data_url("audio/ogg", buffer.getvalue())


def episode_media(trace: Trace, track: NDArray[np.float32], rate: int) -> dict[str, Any]:
    """What a page shows of an episode step by step, beside its views."""
    heading = (trace.state % HEADINGS)[:, None]
    return {
        "title": title_of(trace),
        "outcome": outcome(trace),
        "goal": _rounded(trace.goal),
        "path": _rounded(np.concatenate((trace.path, heading), axis=1)),
        "action": trace.action.tolist(),
        "collided": trace.collided.astype(int).tolist(),
        "heard": None if trace.heard is None else _rounded(trace.heard),
        "belief": _belief(trace),
        "memory": _memory(trace),
        "sound": sound_url(track, rate),
    }


def _belief(trace: Trace) -> dict[str, Any] | None:
    thoughts = trace.thoughts
    if thoughts is None or thoughts.free is None or not len(trace.action):
        return None
    height, width = thoughts.free.shape[1:]
    left, bottom = (thoughts.low - 0.5) * CELL
    return {
        "left": float(left),
        "top": float(bottom + CELL * height),
        "width": width,
        "height": height,
        "free": base64.b64encode(thoughts.free.tobytes()).decode("ascii"),
    }


def _memory(trace: Trace) -> dict[str, Any] | None:
    """The walk that an agent remembers, and the places that its memory returned."""
    thoughts = trace.thoughts
    if thoughts is None or thoughts.retrieved is None or trace.walk is None:
        return None
    walk = trace.place.grid.centres[trace.walk // HEADINGS]
    return {"walk": _rounded(walk), "entries": _rounded(thoughts.retrieved[..., :2])}


def _rounded(values: NDArray[np.float64]) -> list[Any]:
    found: list[Any] = np.round(np.asarray(values, dtype=np.float64), 2).tolist()
    return found
