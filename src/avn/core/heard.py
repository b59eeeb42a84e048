"""Layout of the observation `arrival`: the heads of a sound network in one vector."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from avn.core.errors import UserError

# Numbers behind the bins of the bearing: mean and standard deviation of the logarithm of the length
# of the path in metres, log-odds of being in sight, metres right and front, standard deviation.
OTHERS = 6


def check_bins(bins: int) -> None:
    """Raise `UserError` for a number of directions of a sound model that the planner cannot use."""
    if bins % 4 or not 8 <= bins <= 252:
        raise UserError(f"sound_model.bins: {bins}; give a multiple of 4 from 8 to 252")


def bearing_label(arrival: Tensor, bins: int, spread: float) -> Tensor:
    """Return the distribution of a direction over bins, spread around it.

    Parameters
    ----------
    arrival : (N, 2) tensor
        Unit vectors, right and front; 0 for none, which is spread evenly.
    bins : int
        Directions B, clockwise from the front.
    spread : float
        Standard deviation in radians, of a von Mises distribution.

    Returns
    -------
    (N, B) tensor
        Probabilities.
    """
    angle = torch.atan2(arrival[:, 0], arrival[:, 1])
    centres = torch.arange(bins, device=arrival.device) * (2 * math.pi / bins)
    label = (torch.cos(angle[:, None] - centres) / spread**2).softmax(1)
    there = arrival.square().sum(1, keepdim=True) > 0
    return torch.where(there, label, torch.full_like(label, 1 / bins))


@dataclass(frozen=True)
class Arrivals:
    """Arrival of a sound, as a network hears it.

    Parameters
    ----------
    values : (..., B + 6) float tensor
        Log-probabilities of B directions of arrival, clockwise from the front, and `OTHERS`.
    """

    values: Tensor

    @property
    def bins(self) -> int:
        """B."""
        return int(self.values.shape[-1]) - OTHERS

    @property
    def bearing(self) -> Tensor:
        """Log-probability of each direction of arrival, (..., B)."""
        return self.values[..., : self.bins]

    @property
    def information(self) -> Tensor:
        """Information of the direction of arrival in nats, (...): 0 if all are as likely."""
        entropy = -(self.bearing.exp() * self.bearing).sum(-1)
        return (math.log(self.bins) - entropy).clamp_min(0)

    @property
    def distance(self) -> Tensor:
        """Mean and standard deviation of the logarithm of the path's length, (..., 2)."""
        return self.values[..., self.bins : self.bins + 2]

    @property
    def in_sight(self) -> Tensor:
        """Log-odds that the source is in sight, (...)."""
        return self.values[..., self.bins + 2]

    @property
    def location(self) -> Tensor:
        """Location of the source, metres right and front, (..., 2)."""
        return self.values[..., self.bins + 3 : self.bins + 5]

    @property
    def location_sigma(self) -> Tensor:
        """Standard deviation of the location along each axis, metres, (...)."""
        return self.values[..., self.bins + 5]
