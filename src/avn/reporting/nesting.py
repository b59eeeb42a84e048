"""Records of episodes as metrics of starts within sources within apartments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.reporting.bootstrap import Nested

# Column of the network of a record, in records of several networks.
NETWORK = "train_seed"
# A start is walked once with each sound.
_START = ["scene", "source", "seed", "episode"]


def nested(episodes: pd.DataFrame, columns: Sequence[str]) -> Nested:
    """Return the metrics of episodes by start, source and apartment, in an order of their own.

    Parameters
    ----------
    episodes : DataFrame
        Records of one agent. Those of several networks have the column `NETWORK`.
    columns : sequence of str
        Columns of the metrics.

    Raises
    ------
    UserError
        If the networks have different episodes.
    """
    networks = [NETWORK] if NETWORK in episodes else []
    ordered = episodes.sort_values([*_START, *networks, "sound"], kind="stable")
    start = _numbered(ordered[_START])
    source = _numbered(ordered[["scene", "source"]])
    scene = _numbered(ordered[["scene"]])
    network = np.zeros_like(start)
    if networks:
        network = np.unique(ordered[NETWORK], return_inverse=True)[1]
    count = int(network.max()) + 1
    cell = start * count + network
    sizes = np.bincount(cell, minlength=(start[-1] + 1) * count).reshape(-1, count)
    if (sizes != sizes[:, :1]).any():
        raise UserError("train_seed: the networks walked different episodes; run all of them")
    firsts = np.flatnonzero(np.diff(cell, prepend=-1))
    places = np.flatnonzero(np.diff(start, prepend=-1))
    sums = np.add.reduceat(ordered[list(columns)].to_numpy(np.float64), firsts)
    own = source[places]
    return Nested(
        sums=sums.reshape(*sizes.shape, -1),
        counts=sizes[:, 0].astype(np.float64),
        source=own.astype(np.int64),
        scene=scene[places][np.flatnonzero(np.diff(own, prepend=-1))].astype(np.int64),
    )


def _numbered(ordered: pd.DataFrame) -> NDArray[np.int64]:
    """Return the number of the group of equal rows of each row of a sorted table, (N,)."""
    changed = np.zeros(len(ordered), dtype=np.bool_)
    for name in ordered:
        values = ordered[name].to_numpy()
        changed[1:] |= values[1:] != values[:-1]
    return np.cumsum(changed, dtype=np.int64)
