"""Settings of the config group `acoustics`; importing them needs no numerical library."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class AcousticsConfig:
    """Acoustics of a world, the node `acoustics` of the config.

    Attributes
    ----------
    name : str
        Name of the regime, as files and tables have it.
    direct_path : {"transmission", "diffraction"}
        Direct path where a wall blocks the line of sight: through walls, or round their corners.
    seconds : float
        Length of the impulse responses.
    rate : int
        Sampling rate of impulse responses, clips and the inputs of networks, Hz.
    rays : int
        Number of rays from each source.
    depth : int
        Largest number of reflections of a ray; time and loss end most rays before.
    receiver_radius : float
        Radius of the spheres that receive rays, metres.
    receiver_height, source_height : float
        Metres above the floor.
    head : str
        Head of the listener: `ku100`, `kemar` or the path of a SOFA file of measured head-related
        impulse responses.
    air : bool
        True for absorption by air, of reflections and of the direct sound.
    seed : int
        Seed of the ray tracing.
    """

    name: str = "resonance"
    direct_path: str = "transmission"
    seconds: float = 0.6
    rate: int = 16000
    rays: int = 10000
    depth: int = 250
    receiver_radius: float = 0.25
    receiver_height: float = 1.5
    source_height: float = 1.0
    head: str = "ku100"
    air: bool = True
    seed: int = 0
