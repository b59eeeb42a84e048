"""Layout of the observation `arrival`: the heads of a sound network in one vector."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

# Numbers behind the bins of the bearing: mean and standard deviation of the logarithm of the length
# of the path in metres, log-odds of being in sight, metres right and front, standard deviation.
OTHERS = 6


@dataclass(frozen=True)
class Arrivals:
    """What is heard of the arrival of a sound.

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
