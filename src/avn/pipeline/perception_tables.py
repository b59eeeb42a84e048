"""How far what a run's agent hears, sees and recognises lies from the truth, beside its records."""

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
from avn.pipeline.audio_inference import sound_errors
from avn.pipeline.observations import Observed
from avn.pipeline.occupancy import OccupancyNetwork, window_errors
from avn.pipeline.sounds import sound_files
from avn.reporting import perception_tables, results
from avn.reporting.table import wide_console

HEARD, SEEN, PLACES = "source_estimates.csv", "local_patches.csv", "localisation.csv"
TABLES = {
    HEARD: perception_tables.source_estimates_table,
    SEEN: perception_tables.local_patches_table,
    PLACES: perception_tables.localisation_table,
}


def write(
    observed: Observed,
    rooms: Sequence[Scene],
    walks: Sequence[NDArray[np.int64]],
    observations: Sequence[SceneObservations],
    folder: Path,
) -> None:
    """Write a table for each thing that a network tells the agent of the rooms.

    Parameters
    ----------
    observed : Observed
        What the agent observes.
    rooms : sequence of Scene
    walks : sequence of (W, T) int64
        Exploration walks in each room, as states.
    observations : sequence of SceneObservations
        What is heard and seen in each room.
    """
    cfg, stages = observed.cfg, observed.stages
    if "source_estimate" in stages:
        heard = [own.audio["source_estimate"] for own in observations]
        results.write_csv(_heard(cfg, rooms, heard), folder / HEARD)
    if "local_patch" in stages:
        estimates = [own[:, 0] for own in stages["local_patch"].load()]
        prior = OccupancyNetwork(cfg).prior()
        seen = window_errors(rooms, typed(cfg.renderer.camera), estimates, prior)
        results.write_csv(seen, folder / SEEN)
    if "visual_embedding" in stages and "top" in cfg.mapper:
        features = [own.visual["visual_embedding"] for own in observations]
        results.write_csv(_places(cfg, rooms, walks, features), folder / PLACES)


def show(folder: Path) -> None:
    """Print the tables of a run's folder."""
    console = wide_console()
    for name, table in TABLES.items():
        if (folder / name).is_file():
            console.print(table(results.read_csv(folder / name)))
            console.print()


def _heard(cfg: DictConfig, rooms: Sequence[Scene], heard: Sequence[Tensor]) -> pd.DataFrame:
    names = tuple(sound_files(cfg))
    errors = [sound_errors(room, own, names) for room, own in zip(rooms, heard, strict=True)]
    return pd.concat(errors, ignore_index=True).assign(acoustics=cfg.acoustics.name)


def _places(
    cfg: DictConfig,
    rooms: Sequence[Scene],
    walks: Sequence[NDArray[np.int64]],
    features: Sequence[Tensor],
) -> pd.DataFrame:
    found = []
    for room, own, seen in zip(rooms, walks, features, strict=True):
        lattice = torch.from_numpy(room.grid.lattice).long()
        found.append(place_errors(lattice, seen, torch.from_numpy(own), cfg.mapper.top))
        found[-1].insert(0, "scene", room.name)
    return pd.concat(found, ignore_index=True)
