"""`mapper=spatial_memory`: pictures are keys, places are values; a place is found by its looks.

After the key-value memory of Gan et al. (ICRA 2020), section IV-A.
"""

from __future__ import annotations

import torch
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.errors import UserError


class SpatialMemory:
    """Pictures that N agents remember, and where each was taken.

    Parameters
    ----------
    keys : (W, K, D) float32 tensor
        l2-normalised features of exploration walks; rows of zeros are empty.
    values : (W, K, 3) int64 tensor
        Right, front and heading where they were seen.
    walk : (N,) int64 tensor
        Which walk each agent remembers.
    top : int
        How many entries an estimate is made of.

    Raises
    ------
    UserError
        Where `top` is less than 1.
    """

    def __init__(self, keys: Tensor, values: Tensor, walk: Tensor, top: int = 3) -> None:
        if top < 1:
            raise UserError(f"mapper.top: {top}; give 1 or more entries")
        self.top, self.walk = top, walk
        self._keys, self._values = keys, values
        n, features = len(walk), keys.shape[-1]
        self._own_keys = torch.zeros(n, 0, features)
        self._own_values = torch.zeros(n, 0, 3, dtype=torch.int64)
        self._own = torch.zeros(n, dtype=torch.int64)

    def add(self, features: Tensor, places: Tensor, rows: Tensor) -> None:
        """Remember one more picture of some agents.

        Parameters
        ----------
        features : (N, D) float32 tensor
        places : (N, 3) int64 tensor
        rows : (N,) bool tensor
            Whose pictures are remembered.
        """
        chosen = rows.nonzero()[:, 0]
        if not len(chosen):
            return
        if int(self._own[chosen].max()) == self._own_keys.shape[1]:
            more = max(16, self._own_keys.shape[1])
            self._own_keys = torch.nn.functional.pad(self._own_keys, (0, 0, 0, more))
            self._own_values = torch.nn.functional.pad(self._own_values, (0, 0, 0, more))
        self._own_keys[chosen, self._own[chosen]] = features[chosen]
        self._own_values[chosen, self._own[chosen]] = places[chosen]
        self._own[chosen] += 1

    def recall(self, features: Tensor, own: bool = True) -> tuple[Tensor, Tensor]:
        """The entries whose pictures are most like those that the agents see.

        Parameters
        ----------
        features : (N, D) float32 tensor
            l2-normalised.
        own : bool
            Whether what was added counts beside the walks.

        Returns
        -------
        similarity : (N, top) float32 tensor
            Cosine, falling; -inf where the memory has fewer entries.
        places : (N, top, 3) int64 tensor

        Raises
        ------
        UserError
            Where a memory has no entry.
        """
        size = self._keys.shape[1]
        likeness = torch.full((len(features), size), -torch.inf)
        for index in self.walk.unique().tolist():  # a walk that agents share is looked up at once
            rows = (self.walk == index).nonzero()[:, 0]
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
        places = self._values[self.walk[:, None], entry.clamp(max=size - 1)]
        later = entry >= size
        if bool(later.any()):
            row = torch.arange(len(entry))[:, None].expand_as(entry)
            places[later] = self._own_values[row[later], entry[later] - size]
        return similarity, places


def locate(similarity: Tensor, places: Tensor) -> Tensor:
    """Where N agents are, by what their pictures are like.

    Parameters
    ----------
    similarity : (N, k) float32 tensor
        Falling; -inf for no entry.
    places : (N, k, 3) int64 tensor

    Returns
    -------
    (N, 3) float64 tensor
        Mean of the locations; the heading that most entries have, of equal ones that of the most
        similar entry.
    """
    there = ~similarity.isinf()
    weight = there.double()[..., None]
    location = (places[..., :2] * weight).sum(dim=1) / weight.sum(dim=1)
    votes = torch.nn.functional.one_hot(places[..., 2], HEADINGS) * there[..., None]
    # the first of equals is that of the most similar entry: it has a little more of a vote
    votes = votes.double()
    votes[:, 0] *= 1.5
    return torch.cat((location, votes.sum(dim=1).argmax(dim=1, keepdim=True).double()), dim=1)


def distinct(features: Tensor, places: Tensor) -> tuple[Tensor, Tensor]:
    """Walks as keys and values, each place and heading once.

    Parameters
    ----------
    features : (W, T, D) float32 tensor
    places : (W, T, 3) int64 tensor

    Returns
    -------
    keys : (W, K, D) float32 tensor
        Filled up with zeros.
    values : (W, K, 3) int64 tensor
    """
    chosen = []
    for walk in places:
        _, first = torch.unique(walk, dim=0, return_inverse=True)
        order = torch.full((int(first.max()) + 1,), len(walk)).scatter_reduce(
            0, first, torch.arange(len(walk)), "amin"
        )
        chosen.append(order.sort().values)
    keys = [own[index] for own, index in zip(features, chosen, strict=True)]
    values = [own[index] for own, index in zip(places, chosen, strict=True)]
    pad = torch.nn.utils.rnn.pad_sequence
    return pad(keys, batch_first=True), pad(values, batch_first=True)
