"""Pairing of the records of two agents, or two settings, that walked the same episodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from avn.core.errors import UserError
from avn.reporting.nesting import NETWORK

# Identity of an episode of a network; names of the columns in messages.
_EPISODE = {"sound": "sounds", "scene": "apartments", "seed": "seeds", "episode": "episodes"}
# What the same episode has in common, in the order in which a difference is named.
_SAME = {
    "protocol": "protocols",
    "source": "sources",
    "source_cell": "source positions",
    "start_cell": "starts",
    "start_heading": "starts",
    "geodesic": "floor plans",
    "euclidean": "floor plans",
}
_SHOWN = 6


def paired(
    one: pd.DataFrame, other: pd.DataFrame, names: Sequence[str] = ("the first", "the second")
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the records of both sides with the same episode in each row.

    Several networks (column `train_seed`) are paired by their seed. A side with a single network is
    repeated for each network of the other side.

    Parameters
    ----------
    one, other : DataFrame
        Records as in `episodes.csv`, of one agent and setting each.
    names : sequence of str
        Names of both sides, for messages.

    Raises
    ------
    UserError
        Where the episodes or the networks differ; the message names what differs.
    """
    sides = _with_networks(one, other, names)
    for column, what in _EPISODE.items():
        _check_values([side[column] for side in sides], what, names)
    keys = [*_EPISODE, NETWORK]
    first, second = (side.sort_values(keys, kind="stable") for side in sides)
    for side, name in zip((first, second), names, strict=True):
        if side.duplicated(keys).any():
            raise UserError(f"{name} has an episode twice; give each run once")
    if len(first) != len(second) or (first[keys].to_numpy() != second[keys].to_numpy()).any():
        raise UserError(f"{_pair(names)} walked different episodes; {_HINT}")
    for column, what in _SAME.items():
        if column in first and column in second:
            values = [side[column].to_numpy() for side in (first, second)]
            if not _equal(*values):
                raise UserError(f"{_pair(names)} have different {what}{_of(values)}; {_HINT}")
    return first.reset_index(drop=True), second.reset_index(drop=True)


_HINT = "only runs of the same episodes are compared"


def _with_networks(
    one: pd.DataFrame, other: pd.DataFrame, names: Sequence[str]
) -> list[pd.DataFrame]:
    """Return both sides with a column `NETWORK` of the same networks."""
    sides = [side if NETWORK in side else side.assign(**{NETWORK: 0}) for side in (one, other)]
    networks = [sorted(side[NETWORK].unique()) for side in sides]
    if networks[0] == networks[1]:
        return sides
    if 1 not in map(len, networks):
        texts = [f"{_list(own)} of {name}" for own, name in zip(networks, names, strict=True)]
        raise UserError(
            f"train_seed: {' and '.join(texts)}; give the same networks, or a single one of a side"
        )
    wanted = networks[0] if len(networks[1]) == 1 else networks[1]
    return [
        side
        if own == wanted
        else pd.concat([side.assign(**{NETWORK: network}) for network in wanted])
        for side, own in zip(sides, networks, strict=True)
    ]


def _check_values(columns: Sequence[pd.Series], what: str, names: Sequence[str]) -> None:
    """Refuse sides of which a column has different values."""
    values = [sorted(column.unique()) for column in columns]
    if values[0] != values[1]:
        texts = [f"{_list(own)} of {name}" for own, name in zip(values, names, strict=True)]
        if what == "episodes":
            texts = [f"{len(own)} of {name}" for own, name in zip(values, names, strict=True)]
        raise UserError(f"{what} differ: {' and '.join(texts)}; {_HINT}")


def _equal(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether two columns agree; distances to 1e-6."""
    if one.dtype.kind == "f" or other.dtype.kind == "f":
        return bool(np.allclose(one, other, rtol=0.0, atol=1e-6, equal_nan=True))
    return bool((one == other).all())


def _of(values: Sequence[np.ndarray]) -> str:
    """Return the values of columns of text, for a message."""
    if values[0].dtype.kind in "iuf":
        return ""
    return f" ({' and '.join(_list(sorted(set(column))) for column in values)})"


def _pair(names: Sequence[str]) -> str:
    return " and ".join(names)


def _list(values: Sequence[object]) -> str:
    texts = list(map(str, values))
    more = f" and {len(texts) - _SHOWN} more" if len(texts) > _SHOWN else ""
    return ", ".join(texts[:_SHOWN]) + more
