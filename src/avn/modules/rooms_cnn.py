"""Occupancy network that tells furniture from walls."""

from __future__ import annotations

from torch import Tensor, nn

from avn.modules.occupancy_cnn import OccupancyCnn, ViewBatch


class RoomsCnn(OccupancyCnn):
    """Occupancy network that also estimates which cells are part of a room, furnished or not.

    The other cells are those of walls, and those outside. Sound passes over furniture and not
    through walls, so the paths of sound need this map and not that of free cells.

    Parameters
    ----------
    **recipe
        Those of `OccupancyCnn`.
    """

    outputs = 3
    rooms = 2  # their channel

    def other_losses(self, log_odds: Tensor, batch: ViewBatch) -> Tensor:
        """Return half the cross-entropy of visible, and that of being part of a room."""
        rooms = nn.functional.binary_cross_entropy_with_logits(
            log_odds[:, self.rooms], batch["rooms"]
        )
        return super().other_losses(log_odds, batch) + rooms
