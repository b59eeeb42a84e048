"""Spatial memory: features of views are keys, and their poses are values.

After the key-value memory of Gan et al., "Look, Listen, and Act: Towards Audio-Visual Embodied
Navigation" (ICRA 2020), section IV-A.
"""

from __future__ import annotations

import torch
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.errors import UserError


class SpatialMemory:
    """Key-value memories of N agents.

    Parameters
    ----------
    keys : (W, K, D) float32 tensor
        l2-normalised features along the exploration trajectories; rows of zeros are empty.
    values : (W, K, 3) int64 tensor
        Poses of the views: squares to the right, squares to the front and heading.
    trajectory_index : (N,) int64 tensor
        Trajectory of each agent.
    top : int
        Entries that are retrieved, 1 or more.

    Raises
    ------
    UserError
        If `top` is less than 1.
    """

    def __init__(
        self, keys: Tensor, values: Tensor, trajectory_index: Tensor, top: int = 3
    ) -> None:
        if top < 1:
            raise UserError(f"mapper.top: {top}; give 1 or more entries")
        self.top, self.trajectory_index = top, trajectory_index
        self._keys, self._values = keys, values
        self._empty = (keys == 0).all(dim=-1)  # rows of padding
        n, features = len(trajectory_index), keys.shape[-1]
        self._own_keys = torch.zeros(n, 0, features)
        self._own_values = torch.zeros(n, 0, 3, dtype=torch.int64)
        self._own = torch.zeros(n, dtype=torch.int64)

    def add(self, features: Tensor, poses: Tensor, rows: Tensor) -> None:
        """Add one entry to the memories of some agents.

        Parameters
        ----------
        features : (N, D) float32 tensor
            l2-normalised features of the views.
        poses : (N, 3) int64 tensor
            Poses of the views.
        rows : (N,) bool tensor
            Agents whose entry is added.
        """
        chosen = rows.nonzero()[:, 0]
        if not len(chosen):
            return
        if int(self._own[chosen].max()) == self._own_keys.shape[1]:
            more = max(16, self._own_keys.shape[1])
            self._own_keys = torch.nn.functional.pad(self._own_keys, (0, 0, 0, more))
            self._own_values = torch.nn.functional.pad(self._own_values, (0, 0, 0, more))
        self._own_keys[chosen, self._own[chosen]] = features[chosen]
        self._own_values[chosen, self._own[chosen]] = poses[chosen]
        self._own[chosen] += 1

    def nearest(self, location: Tensor) -> Tensor:
        """Return the visited square nearest to each agent's location.

        Parameters
        ----------
        location : (N, 2) float64 tensor
            Squares to the right and to the front.

        Returns
        -------
        (N, 2) int64 tensor
            The first along the trajectory of those equally near.
        """
        places = self._values[self.trajectory_index, :, :2]
        away = (places - location[:, None]).square().sum(dim=-1)
        empty = self._empty[self.trajectory_index]
        index = away.masked_fill(empty, torch.inf).argmin(dim=1)
        return places[torch.arange(len(places)), index]

    def recall(self, features: Tensor, own: bool = True) -> tuple[Tensor, Tensor]:
        """Retrieve the entries most similar to the views of the agents.

        Parameters
        ----------
        features : (N, D) float32 tensor
            l2-normalised features of the views.
        own : bool
            True to include the entries that `add` added.

        Returns
        -------
        similarity : (N, top) float32 tensor
            Cosine similarities in descending order; -inf for missing entries.
        poses : (N, top, 3) int64 tensor
            Poses of the entries.

        Raises
        ------
        UserError
            If a memory has no entry.
        """
        size = self._keys.shape[1]
        likeness = torch.full((len(features), size), -torch.inf)
        # agents with the same trajectory share a product
        for index in self.trajectory_index.unique().tolist():
            rows = (self.trajectory_index == index).nonzero()[:, 0]
            own_keys = self._keys[index]
            found = features[rows] @ own_keys.T
            empty = ~own_keys.any(dim=-1)
            likeness[rows] = found.masked_fill(empty, -torch.inf)
        if own and self._own_keys.shape[1]:
            added = torch.bmm(self._own_keys, features[:, :, None])[:, :, 0]
            empty = torch.arange(added.shape[1]) >= self._own[:, None]
            likeness = torch.cat((likeness, added.masked_fill(empty, -torch.inf)), dim=1)
        if not likeness.shape[1] or bool(likeness.amax(dim=1).isinf().any()):
            raise UserError(
                "mapper: the spatial memory has no entry; explore first "
                "(protocol.exploration_steps=400)"
            )
        similarity, entry = likeness.topk(min(self.top, likeness.shape[1]), dim=1)
        poses = self._values[self.trajectory_index[:, None], entry.clamp(max=size - 1)]
        later = entry >= size
        if bool(later.any()):
            row = torch.arange(len(entry))[:, None].expand_as(entry)
            poses[later] = self._own_values[row[later], entry[later] - size]
        return similarity, poses


def locate(similarity: Tensor, poses: Tensor) -> Tensor:
    """Estimate the poses of N agents from retrieved entries.

    Parameters
    ----------
    similarity : (N, k) float32 tensor
        Cosine similarities in descending order; -inf for missing entries.
    poses : (N, k, 3) int64 tensor
        Poses of the entries.

    Returns
    -------
    (N, 3) float64 tensor
        Mean position, and the most frequent heading; ties go to the most similar entry.
    """
    there = ~similarity.isinf()
    weight = there.double()[..., None]
    location = (poses[..., :2] * weight).sum(dim=1) / weight.sum(dim=1)
    votes = torch.nn.functional.one_hot(poses[..., 2], HEADINGS) * there[..., None]
    # the most similar entry has a larger vote, which decides ties
    votes = votes.double()
    votes[:, 0] *= 1.5
    return torch.cat((location, votes.sum(dim=1).argmax(dim=1, keepdim=True).double()), dim=1)


def distinct(features: Tensor, poses: Tensor) -> tuple[Tensor, Tensor]:
    """Collect the distinct poses of each trajectory as keys and values of a memory.

    Parameters
    ----------
    features : (W, T, D) float32 tensor
        l2-normalised features along the trajectories.
    poses : (W, T, 3) int64 tensor
        Poses along the trajectories.

    Returns
    -------
    keys : (W, K, D) float32 tensor
        Features at the first visit of each pose, padded with zeros.
    values : (W, K, 3) int64 tensor
        Poses, padded with zeros.
    """
    chosen = []
    for trajectory in poses:
        _, first = torch.unique(trajectory, dim=0, return_inverse=True)
        order = torch.full((int(first.max()) + 1,), len(trajectory)).scatter_reduce(
            0, first, torch.arange(len(trajectory)), "amin"
        )
        chosen.append(order.sort().values)
    keys = [own[index] for own, index in zip(features, chosen, strict=True)]
    values = [own[index] for own, index in zip(poses, chosen, strict=True)]
    pad = torch.nn.utils.rnn.pad_sequence
    return pad(keys, batch_first=True), pad(values, batch_first=True)
