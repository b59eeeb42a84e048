"""Schedule of a sound that begins late and ends before its episode does."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.special import ndtri
from torch import Tensor

from avn.core.errors import UserError
from avn.core.random import uniform


class Schedule:
    """Time at which the sound of an episode begins, uniform, and its duration, normal.

    An action takes one second. The distributions are those of Chen, Al-Halah and Grauman,
    "Semantic Audio-Visual Navigation" (CVPR 2021).

    Parameters
    ----------
    begins : (float, float)
        Earliest and latest beginning, seconds, 0 or more.
    mean, deviation : float
        Mean and standard deviation of the duration, seconds, 0 or more.
    least : float
        Shortest duration, seconds, more than 0; what is drawn below it becomes it.

    Raises
    ------
    UserError
        If a value is out of range.
    """

    def __init__(
        self,
        begins: Sequence[float] = (0.0, 5.0),
        mean: float = 15.0,
        deviation: float = 9.0,
        least: float = 1.0,
    ) -> None:
        ends = [float(value) for value in begins]
        if len(ends) != 2 or not 0 <= ends[0] <= ends[1] or not isfinite(ends[1]):
            raise UserError(
                f"schedule.begins: {list(begins)}; give the earliest and the latest beginning in "
                "seconds, such as [0, 5]"
            )
        for key, value in (("mean", mean), ("deviation", deviation)):
            if not (isfinite(value) and value >= 0):
                raise UserError(f"schedule.{key}: {value}; give seconds, 0 or more")
        if not (isfinite(least) and least > 0):
            raise UserError(f"schedule.least: {least}; give seconds, more than 0")
        self.begins, self.mean, self.deviation, self.least = ends, mean, deviation, least

    def draw(self, keys: NDArray[np.uint64]) -> tuple[Tensor, Tensor]:
        """Draw when the sounds of N episodes begin and end, seconds, (N,) float64 each.

        Parameters
        ----------
        keys : (N,) uint64
            Key of each episode's random numbers.
        """
        low, high = self.begins
        begin = low + (high - low) * uniform(keys, 0)
        # 53 random bits never give 1, and 0 gives minus infinity, which becomes the least duration
        duration = np.maximum(self.mean + self.deviation * ndtri(uniform(keys, 1)), self.least)
        return torch.from_numpy(begin), torch.from_numpy(begin + duration)
