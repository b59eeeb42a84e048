"""An apartment of two rooms with impulse responses by a formula, for tests of what hears."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from avn.acoustics.clips import DrySounds
from avn.apartments.floor_plan import Doorway, FloorPlan, Room
from avn.apartments.grid import Grid, build_grid, source_cells
from avn.dataset.source_locations import relative_locations


class FreeFieldBrirs:
    """One arrival an ear, with level and delay after the source's direction and distance."""

    def __init__(self, locations: Tensor, rate: int) -> None:
        self.locations, self.scale = locations, rate / 16000
        self.samples = round(400 * self.scale)

    def gather(self, source: Tensor, state: Tensor) -> Tensor:
        where = self.locations[source, state]
        distance = where.norm(dim=-1).clamp_min(0.5)
        side, front = (where / distance[:, None]).unbind(-1)
        time = torch.arange(self.samples)
        ears = []
        for sign in (-1.0, 1.0):
            gain = (1 + 0.6 * sign * side) * (1 + 0.3 * front) / distance
            ears.append(
                gain[:, None] * torch.sinc(time - self.scale * (40 - 6 * sign * side[:, None]))
            )
        return torch.stack(ears, 1)


@dataclass
class SyntheticScene:
    """What code that hears asks of a scene."""

    plan: FloorPlan
    grid: Grid
    sources: np.ndarray
    in_sight: np.ndarray
    rate: int = 16000

    @property
    def name(self) -> str:
        return self.plan.name

    @property
    def brirs(self) -> FreeFieldBrirs:
        lattice = torch.from_numpy(self.grid.lattice.astype(np.int64))
        return FreeFieldBrirs(
            relative_locations(lattice, torch.from_numpy(self.sources.astype(np.int64))), self.rate
        )


def synthetic_scene(
    name: str = "two_rooms", width: float = 2.0, rate: int = 16000
) -> SyntheticScene:
    """Two rooms side by side, each `width` wide and 2 m deep, with a source in each."""
    looks = ("parquet", "plaster", "ceiling_plaster")
    plan = FloorPlan(
        name,
        (Room("kitchen", 0, 0, width, 2, *looks), Room("bedroom", width, 0, 2 * width, 2, *looks)),
        (Doorway(width, 1, "y"),),
        sources=((0.5, 0.5), (2 * width - 0.5, 1.5)),
    )
    grid = build_grid(plan)
    sources = source_cells(plan, grid)
    in_sight = grid.rooms[None] == grid.rooms[sources][:, None]
    return SyntheticScene(plan, grid, sources, in_sight, rate)


def synthetic_sounds(rate: int = 16000) -> DrySounds:
    """Two noises, one of them dull."""
    noise = np.random.default_rng(0).standard_normal((2, 5 * rate // 4))
    noise[1] = np.convolve(noise[1], np.hanning(9), mode="same")
    bank = {"hiss": noise[0].astype(np.float32), "hum": noise[1].astype(np.float32)}
    return DrySounds(bank, rate=rate)
