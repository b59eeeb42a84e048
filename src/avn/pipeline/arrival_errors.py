"""Errors of how a run's agent hears the sound arrive, over a sample of the clips of its world."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
import torch
from torch import Tensor

from avn.acoustics.settings import AcousticsConfig
from avn.core.clip_id import ClipId
from avn.core.heard import Arrivals
from avn.dataset.arrivals import arrivals
from avn.dataset.scene import Scene
from avn.dataset.source_locations import locate_sources
from avn.modules.arrival_metrics import arrival_errors
from avn.navigation.observations import SceneObservations

# Clips of each apartment, drawn from all sources, states and sounds.
CLIPS = 1000


def errors_by_scene(
    scenes: Sequence[Scene], observed: Sequence[SceneObservations], acoustics: AcousticsConfig
) -> pd.DataFrame:
    """Compute the median errors of the observation `arrival` in each apartment.

    Parameters
    ----------
    scenes : sequence of Scene
        Apartments.
    observed : sequence of SceneObservations
        Observations in each apartment, in a table or rendered when they are heard.
    acoustics : AcousticsConfig
        Acoustics of the apartments, which define the true arrival.

    Returns
    -------
    DataFrame
        A row for each scene and sight: scene, sight, clips, `arrival_deg`, the error of the
        direction of arrival in degrees, `log_length`, that of the logarithm of the path's length,
        and `behind`, the share of directions that are wrong by more than 90 degrees.
    """
    rows = []
    for scene, own in zip(scenes, observed, strict=True):
        truth, (_, in_sight) = arrivals(scene, acoustics), locate_sources(scene)
        clip = _sample(truth.shape[0], truth.shape[1], own.sounds or 1)
        target = truth[clip.source, clip.state]
        degrees, logs = arrival_errors(Arrivals(_heard(own, clip).float()), target)
        there = target[:, :2].square().sum(1) > 0
        seen = in_sight[clip.source, clip.state]
        for sight, group in (("in_sight", seen & there), ("out_of_sight", ~seen & there)):
            if group.any():
                rows.append(
                    {
                        "scene": scene.name,
                        "sight": sight,
                        "clips": int(group.sum()),
                        "arrival_deg": float(degrees[group].median()),
                        "log_length": float(logs[group].median()),
                        "behind": float((degrees[group] > 90).float().mean()),
                    }
                )
    return pd.DataFrame(rows)


def _sample(sources: int, states: int, sounds: int) -> ClipId:
    random = torch.Generator().manual_seed(0)
    source, state, sound = (
        torch.randint(most, (CLIPS,), generator=random) for most in (sources, states, sounds)
    )
    return ClipId(source, state, sound, torch.zeros_like(source))


def _heard(own: SceneObservations, clip: ClipId) -> Tensor:
    if "arrival" in own.rendered:
        return own.rendered["arrival"](clip)
    return own.audio["arrival"][clip]
