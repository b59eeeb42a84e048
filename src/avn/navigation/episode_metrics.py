"""Metrics of the running episodes of a batch."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.apartments.floor_plan import CELL
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.metrics import spl


def episode_metrics(episodes: BatchedEpisodes, collisions: Tensor) -> dict[str, Tensor]:
    """Compute the metrics of N episodes so far; after the last action they are final.

    Parameters
    ----------
    episodes : BatchedEpisodes
        Running episodes.
    collisions : (N,) int64
        Blocked moves of each episode so far.

    Returns
    -------
    dict of str to (N,) tensor
        `success` bool, `spl` float64, `distance_to_goal` float64 in metres along the shortest path
        to the source, and `collisions` int64.
    """
    tables, row = episodes.tables, episodes.tables.goal_row[episodes.source]
    path = episodes.attempted.double()
    if episodes.protocol.path_length == "metres":
        path = CELL * (episodes.attempted - collisions).double()
    shortest = tables.shortest[row + episodes.start]
    return {
        "success": episodes.success.clone(),
        "spl": torch.from_numpy(spl(episodes.success.numpy(), path.numpy(), shortest.numpy())),
        "distance_to_goal": CELL * tables.moves[row + episodes.state].double(),
        "collisions": collisions.clone(),
    }
