"""Views by a formula, for tests of what sees: free cells of the window are painted bright."""

import numpy as np

from avn.datamodules.views import ApartmentViews
from avn.modules.window_net import probe_places
from avn.views.settings import CameraConfig


def synthetic_views(count: int, seed: int, size: int = 32, appearances: int = 1) -> ApartmentViews:
    """Random windows; each free cell brightens the picture where its floor is.

    Half of the other cells are furniture, and part of a room.
    """
    rng = np.random.default_rng(seed)
    free, visible = rng.random((count, 5, 5)) < 0.5, rng.random((count, 5, 5)) < 0.9
    places = probe_places(CameraConfig())[0].numpy()[:, 0]
    pixels = np.clip(((places + 1) / 2 * size).astype(int), 0, size - 1)
    rgb = []
    for _ in range(appearances):
        views = rng.integers(0, 60, (count, size, size, 3)).astype(np.uint8)
        for cell, (x, y) in enumerate(pixels):
            views[free.reshape(count, 25)[:, cell], y - 1 : y + 2, x - 1 : x + 2] += 150
        rgb.append(views)
    depth = rng.uniform(1, 5, (count, size, size)).astype(np.float16)
    depth[:, :4] = 0
    rooms = free | (rng.random((count, 5, 5)) < 0.5)
    return ApartmentViews(rgb, [depth] * appearances, free, visible, rooms)
