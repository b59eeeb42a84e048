"""Errors of estimated source locations, grouped by sight and sound."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.utilities.data import dim_zero_cat

ALL = "all"
SIGHTS = ("in_sight", "out_of_sight")


def location_errors(estimate: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
    """Compute distance and bearing error between estimated and true locations.

    Parameters
    ----------
    estimate, target : (..., 2) float tensors
        Metres to the right and to the front.

    Returns
    -------
    metres, degrees : (...) float tensors
        The bearing error is 0 to 180; it is 0 where either location is that of the agent.
    """
    metres = torch.linalg.vector_norm(estimate - target, dim=-1)
    cross = estimate[..., 0] * target[..., 1] - estimate[..., 1] * target[..., 0]
    dot = (estimate * target).sum(-1)
    return metres, torch.rad2deg(torch.atan2(cross.abs(), dot))


class LocationErrors(Metric):
    """Median location error in metres and bearing error in degrees, by sight and sound.

    Parameters
    ----------
    sounds : sequence of str
        Names of the sounds, by index.
    """

    full_state_update = False

    def __init__(self, sounds: Sequence[str]) -> None:
        super().__init__()
        self.sounds = tuple(sounds)
        for state in ("metres", "degrees", "in_sight", "sound"):
            self.add_state(state, default=[], dist_reduce_fx="cat")

    def update(self, estimate: Tensor, target: Tensor, in_sight: Tensor, sound: Tensor) -> None:
        """Add N estimates.

        Parameters
        ----------
        estimate, target : (N, 2) float tensors
            Metres to the right and to the front.
        in_sight : (N,) bool tensor
            Whether the source is in the line of sight.
        sound : (N,) int64 tensor
            Index of the sound.
        """
        metres, degrees = location_errors(estimate, target)
        self.metres.append(metres)  # type: ignore[union-attr, operator]
        self.degrees.append(degrees)  # type: ignore[union-attr, operator]
        self.in_sight.append(in_sight)  # type: ignore[union-attr, operator]
        self.sound.append(sound)  # type: ignore[union-attr, operator]

    def compute(self) -> dict[str, Tensor]:
        """Return medians by name, such as `error_m/in_sight/ring` or `bearing_deg/all/all`.

        Groups without clips are left out.
        """
        metres, degrees, in_sight, sound = (
            dim_zero_cat(getattr(self, state))
            for state in ("metres", "degrees", "in_sight", "sound")
        )
        sights = {ALL: torch.ones_like(in_sight), SIGHTS[0]: in_sight, SIGHTS[1]: ~in_sight}
        medians: dict[str, Tensor] = {}
        for sight, seen in sights.items():
            for index, name in enumerate((ALL, *self.sounds)):
                group = seen if name == ALL else seen & (sound == index - 1)
                if group.any():
                    medians[f"error_m/{sight}/{name}"] = torch.quantile(metres[group], 0.5)
                    medians[f"bearing_deg/{sight}/{name}"] = torch.quantile(degrees[group], 0.5)
        return medians
