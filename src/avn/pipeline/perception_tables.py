"""Tables of the errors of a run's networks: source estimates, local patches, localisation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from omegaconf import DictConfig
from torch import Tensor

from avn.core.settings import typed
from avn.dataset.scene import Scene
from avn.mapping.place_errors import place_errors
from avn.navigation.observations import SceneObservations
from avn.pipeline.arrival_errors import errors_by_scene
from avn.pipeline.audio_inference import source_estimate_errors
from avn.pipeline.observations import Observed
from avn.pipeline.occupancy import OccupancyNetwork, local_patch_errors
from avn.pipeline.scenes import acoustics_of
from avn.pipeline.sounds import sound_files
from avn.reporting import results
from avn.reporting.finished_run import ARRIVALS, LOCAL_PATCHES, LOCALISATION, SOURCE_ESTIMATES


def write(
    observed: Observed,
    scenes: Sequence[Scene],
    walks: Sequence[NDArray[np.int64]],
    observations: Sequence[SceneObservations],
    folder: Path,
) -> None:
    """Write an error table for each kind of network that the agent uses.

    Parameters
    ----------
    observed : Observed
        Observations of the agent.
    scenes : sequence of Scene
        Scenes of the run.
    walks : sequence of (W, T) int64
        Exploration walks in each scene, as states.
    observations : sequence of SceneObservations
        Observations in each scene.
    folder : Path
        Folder of the run.
    """
    cfg, stages = observed.cfg, observed.stages
    if "source_estimate" in stages and not observed.is_live("source_estimate"):
        source_estimates = [one.audio["source_estimate"] for one in observations]
        results.write_csv(
            _source_estimates(cfg, scenes, source_estimates), folder / SOURCE_ESTIMATES
        )
    if "arrival" in stages and not cfg.distractor._target_:
        acoustics = acoustics_of(observed.apartments)
        results.write_csv(errors_by_scene(scenes, observations, acoustics), folder / ARRIVALS)
    if "local_patch" in stages:
        estimates = [patches[:, 0] for patches in stages["local_patch"].load()]
        prior = OccupancyNetwork(cfg).prior()
        errors = local_patch_errors(scenes, typed(cfg.renderer.camera), estimates, prior)
        results.write_csv(errors, folder / LOCAL_PATCHES)
    if "visual_embedding" in stages and "top" in cfg.mapper:
        features = [one.visual["visual_embedding"] for one in observations]
        results.write_csv(_places(cfg, scenes, walks, features), folder / LOCALISATION)


def _source_estimates(
    cfg: DictConfig, scenes: Sequence[Scene], estimates: Sequence[Tensor]
) -> pd.DataFrame:
    names = tuple(sound_files(cfg))
    errors = [
        source_estimate_errors(scene, clips, names)
        for scene, clips in zip(scenes, estimates, strict=True)
    ]
    return pd.concat(errors, ignore_index=True).assign(acoustics=cfg.acoustics.name)


def _places(
    cfg: DictConfig,
    scenes: Sequence[Scene],
    walks: Sequence[NDArray[np.int64]],
    features: Sequence[Tensor],
) -> pd.DataFrame:
    tables = []
    for scene, states, embeddings in zip(scenes, walks, features, strict=True):
        lattice = torch.from_numpy(scene.grid.lattice).long()
        tables.append(place_errors(lattice, embeddings, torch.from_numpy(states), cfg.mapper.top))
        tables[-1].insert(0, "scene", scene.name)
    return pd.concat(tables, ignore_index=True)
