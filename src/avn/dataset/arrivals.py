"""How the sound of each source arrives at each state of an apartment."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from avn.acoustics.direct_path import find_paths
from avn.acoustics.settings import AcousticsConfig
from avn.apartments.walls import walls
from avn.core.heard import bearing_label
from avn.dataset.scene import Scene
from avn.dataset.source_locations import locate_sources, to_headings


def arrivals(scene: Scene, acoustics: AcousticsConfig) -> Tensor:
    """Compute direction and length of the direct path, and the location, of all pairs.

    Parameters
    ----------
    scene : Scene
        Apartment with K sources and S = 4 C states.
    acoustics : AcousticsConfig
        Its regime and heights are used.

    Returns
    -------
    (K, S, 5) float32 tensor
        Unit vector in plan from the agent towards where the sound comes from, right and front, 0
        where the source is above or below; natural logarithm of the length in metres; location of
        the source, metres right and front.
    """
    centres = np.asarray(scene.grid.centres, dtype=np.float64)
    receivers = np.column_stack([centres, np.full(len(centres), acoustics.receiver_height)])
    blocks = walls(scene.plan)
    found = []
    for cell in scene.sources:
        source = np.array([*centres[cell], acoustics.source_height])
        paths = find_paths(acoustics.direct_path, blocks, source, receivers)
        plan = paths.arrival[:, :2]
        norm = np.linalg.norm(plan, axis=1, keepdims=True)
        level = np.where(norm > 1e-6, plan / np.maximum(norm, 1e-6), 0.0)
        # a state without a path, in a room without a door, is as far as can be
        length = np.log(np.where(np.isfinite(paths.length), paths.length, 100.0))
        found.append(np.column_stack([level, length]))
    direction, length = torch.from_numpy(np.stack(found)).float().split((2, 1), -1)
    turned = to_headings(direction[..., 0], direction[..., 1])
    return torch.cat((turned, length.repeat_interleave(4, 1), locate_sources(scene)[0]), -1)


def true_arrivals(scene: Scene, acoustics: AcousticsConfig, bins: int = 72) -> Tensor:
    """Return the ground truth in the form of what is heard.

    Directions are spread by a bin, logarithms of lengths by 0.1 and locations by 0.1 m.

    Parameters
    ----------
    scene : Scene
        Apartment with K sources and S states.
    acoustics : AcousticsConfig
        Its regime and heights are used.
    bins : int
        Directions of arrival.

    Returns
    -------
    (K, S, bins + 6) float32 tensor
        See `avn.core.heard.Arrivals`.
    """
    truth, (_, in_sight) = arrivals(scene, acoustics), locate_sources(scene)
    direction, length, location = truth.split((2, 1, 2), -1)
    label = bearing_label(direction.flatten(0, 1), bins, 2 * math.pi / bins)
    bearing = label.clamp_min(1e-9).log().unflatten(0, direction.shape[:2])
    small = torch.full_like(length, 0.1)
    sight = torch.where(in_sight, 10.0, -10.0)[..., None]
    return torch.cat((bearing, length, small, sight, location, small), -1)
