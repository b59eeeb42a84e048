"""Pictures of running episodes: the view of the agent, and the map with its path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.dataset.views import Views
from avn.navigation.navigation_scene import NavigationScene
from avn.reporting.trajectory_figures import FRONT, draw_apartment

RENDER_MODES = ("rgb_array",)
# Frames per second of a video.
FPS = 5
# Height and width in pixels of the view, and of the map.
SIZE = 400
_PATH, _SOURCE = "#e0218a", "#ffb000"


def check_render_mode(mode: str | None) -> None:
    """Raise `UserError` for a render mode that does not exist."""
    if mode is not None and mode not in RENDER_MODES:
        raise UserError(f"render_mode: '{mode}' is none of {', '.join(RENDER_MODES)}")


class EpisodePictures:
    """Pictures of episodes in several apartments.

    Parameters
    ----------
    scenes : sequence of NavigationScene
        Apartments.
    views : sequence of Views
        Views of each apartment.
    """

    def __init__(self, scenes: Sequence[NavigationScene], views: Sequence[Views]) -> None:
        self._scenes, self._views = scenes, views
        self._maps: dict[int, _Map] = {}

    def frame(self, number: int, path: Sequence[int], source: int) -> NDArray[np.uint8]:
        """Draw the view of the agent, and to its right the map with path and source.

        Parameters
        ----------
        number : int
            Number of the apartment.
        path : sequence of int
            States of the agent in the apartment, from the start to the current one.
        source : int
            Number of the source in the apartment.

        Returns
        -------
        (400, 800, 3) uint8
            sRGB.
        """
        scene = self._scenes[number]
        view = Image.fromarray(self._views[number].rgb[path[-1]])
        picture = Image.new("RGB", (2 * SIZE, SIZE))
        picture.paste(view.resize((SIZE, SIZE), Image.Resampling.BICUBIC), (0, 0))
        if number not in self._maps:
            self._maps[number] = _Map(scene)
        goal = scene.grid.centres[scene.sources[source]]
        picture.paste(self._maps[number].draw(np.asarray(path), goal), (SIZE, 0))
        return np.asarray(picture)


class _Map:
    """Map of an apartment, drawn once, on which paths are drawn."""

    def __init__(self, scene: NavigationScene) -> None:
        self._centres = scene.grid.centres
        figure = Figure(figsize=(SIZE / 100, SIZE / 100), dpi=100, facecolor="white")
        canvas = FigureCanvasAgg(figure)
        self._axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
        draw_apartment(self._axes, scene)
        low, high = self._centres.min(0) - 0.8, self._centres.max(0) + 0.8
        self._axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        canvas.draw()
        self._background = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())

    def draw(self, path: NDArray[np.int64], goal: NDArray[np.float64]) -> Image.Image:
        """Draw the path of states and the position of the source."""
        picture = self._background.copy()
        brush = ImageDraw.Draw(picture)
        places = self._pixels(self._centres[path // HEADINGS])
        if len(places) > 1:
            brush.line([tuple(place) for place in places], fill=_PATH, width=3)
        x, y = self._pixels(goal[None])[0]
        brush.ellipse((x - 7, y - 7, x + 7, y + 7), fill=_SOURCE, outline="black")
        (x, y), (east, north) = places[-1], FRONT[path[-1] % HEADINGS]
        tip = (x + 11 * east, y - 11 * north)
        sides = [(x - 8 * east + k * 8 * north, y + 8 * north + k * 8 * east) for k in (-1, 1)]
        brush.polygon([tip, *sides], fill="white", outline=_PATH)
        return picture

    def _pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        found: NDArray[np.float64] = self._axes.transData.transform(points)
        return np.stack((found[:, 0], SIZE - found[:, 1]), axis=1)
