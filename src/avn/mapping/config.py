"""The config group `mapper`: what remembers the place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class MapperConfig:
    """Schema of the config node `mapper`.

    Attributes
    ----------
    name : str
    size : int
        Squares along each side of the map.
    visible_above : float
        Squares that are visible by less than this tell nothing of being free.
    """

    _target_: str | None = None
    name: str = "none"
    size: int = 101
    visible_above: float = 0.0


@dataclass
class MemoryConfig(MapperConfig):
    """Schema of `mapper=spatial_memory`; see `avn.mapping.memory_mapper.MemoryMapper`."""

    localisation: str = "retrieval+odometry"
    top: int = 3
    windows: bool = False
    edges: str = "consecutive"
    sharpness: float = 0.02
    confidence: float = 0.5
