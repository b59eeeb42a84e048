"""Binaural room impulse responses of one source: reverberation and first arrival.

The response of listener l in heading h is ``tail[l, h] * scale[l]`` with the first arrival added
from its onset on. Both hold the time of flight.
"""

import hashlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from avn.acoustics import materials
from avn.acoustics.direct_path import LOSS_SECONDS, REGIMES, DirectPaths, find_paths, render_paths
from avn.acoustics.hrtf import load_sh_hrirs
from avn.acoustics.rendering import Binaural, binaural_responses
from avn.acoustics.tracer import Events, trace
from avn.apartments.surfaces import Surfaces
from avn.core.errors import UserError


@dataclass
class AcousticsConfig:
    """Acoustics of a world, the node `acoustics` of the config.

    Attributes
    ----------
    name : str
        Name of the regime, as files and tables have it.
    direct_path : {"transmission", "diffraction"}
        How the direct path gets to the listener: through walls, or round them.
    seconds : float
        Length of the impulse responses.
    rate : int
        Samples a second, of impulse responses, of clips and of what networks hear.
    rays : int
        Rays from each source.
    depth : int
        Reflections of a ray at most; time and loss end most of them before.
    receiver_radius : float
        Metres; a ray that passes so near to the ears is heard.
    receiver_height, source_height : float
        Metres above the floor.
    air : bool
        Whether air absorbs.
    seed : int
        Draws the directions of the rays.
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
    air: bool = True
    seed: int = 0


# What the names of the two regimes mean, wherever they stand.
REGIME_OF = {"resonance": "transmission", "diffraction": "diffraction"}


def check_config(config: AcousticsConfig, node: str = "acoustics") -> AcousticsConfig:
    """The config itself, or a `UserError` that names the key below `node` and what it may be."""
    if config.direct_path not in REGIMES:
        raise UserError(
            f"{node}.direct_path: '{config.direct_path}' is not known; use {' or '.join(REGIMES)}"
        )
    if REGIME_OF.get(config.name, config.direct_path) != config.direct_path:
        raise UserError(
            f"{node}.direct_path: '{config.direct_path}' is not what the regime "
            f"'{config.name}' means; give it a name of its own with {node}.name=mine"
        )
    limits: dict[str, tuple[float, float]] = {
        "seconds": (0.05, 10.0),
        "rate": (8000, 48000),
        "rays": (100, 10_000_000),
        "depth": (1, 100_000),
        "receiver_radius": (0.01, 2.0),
        "receiver_height": (0.1, 2.5),
        "source_height": (0.1, 2.5),
        "seed": (0, 2**62),
    }
    for key, (low, high) in limits.items():
        value = getattr(config, key)
        if not low <= value <= high:
            raise UserError(f"{node}.{key}: {value} is out of range; use {low:g} to {high:g}")
    return config


@dataclass(frozen=True)
class Tail:
    """The reverberation that L listeners hear of one source.

    Attributes
    ----------
    samples : (L, 4, 2, T) int16
        Heading, ear (0 left, 1 right), sample; x `scale` is the response.
    scale : (L,) float32
        0 where nothing arrives.
    cut_db : (L,) float32
        Energy of the reverberation that comes after T samples, in dB of all of it; measured on
        rays that go on for half as long again. -inf where none came.
    """

    samples: NDArray[np.int16]
    scale: NDArray[np.float32]
    cut_db: NDArray[np.float32]


@lru_cache(maxsize=4)
def head_filters(rate: int) -> NDArray[np.float32]:
    """The filters of the shipped heads, (4, 2, 16, taps), made once for each rate."""
    return load_sh_hrirs().filters(rate)


@lru_cache(maxsize=4)
def _binaural(rate: int, samples: int) -> Binaural:
    return Binaural.prepare(head_filters(rate), samples, rate)


def assets_hash() -> str:
    """Hash of the tables that shape responses beside the config: materials and HRIRs."""
    tables = (materials.absorption(materials.NAMES), materials.scattering(materials.NAMES))
    content = hashlib.sha256(repr(materials.NAMES).encode())
    for table in (*tables, load_sh_hrirs().left):
        content.update(np.ascontiguousarray(table).tobytes())
    return content.hexdigest()


def cut_off_energy(events: Events) -> NDArray[np.float32]:
    """Energy after `events.seconds` in dB of all energy, shape (L,), summed over the bands."""
    late = events.distance >= events.seconds * materials.SPEED_OF_SOUND
    energy = events.energy.sum(axis=1, dtype=np.float64)
    people = len(events.starts) - 1
    who = events.listener()
    total = np.bincount(who, weights=energy, minlength=people)
    after = np.bincount(who[late], weights=energy[late], minlength=people)
    share = np.divide(after, total, out=np.zeros(people), where=total > 0)
    with np.errstate(divide="ignore"):
        return (10 * np.log10(share)).astype(np.float32)


def render_source(
    surfaces: Surfaces,
    source: NDArray[np.float64],
    listeners: NDArray[np.float64],
    config: AcousticsConfig,
    absorption: NDArray[np.float64] | None = None,
    scattering: NDArray[np.float64] | None = None,
) -> Tail:
    """Trace one source and render the reverberation for all listeners.

    Works on one thread; to use more cores, give sources to processes. The bytes depend on the
    arguments alone.

    Parameters
    ----------
    surfaces : Surfaces
    source : array, shape (3,)
        Metres.
    listeners : array, shape (L, 3)
        Where the middle of the head is, metres.
    config : AcousticsConfig
    absorption, scattering : array, shape (len(surfaces.materials), 6), optional
        Coefficients in place of those of the materials' names.
    """
    events = trace(
        surfaces,
        source,
        listeners,
        rays=config.rays,
        depth=config.depth,
        seconds=config.seconds,
        seed=config.seed,
        radius=config.receiver_radius,
        absorption=absorption,
        scattering=scattering,
        air=config.air,
    )
    binaural = _binaural(config.rate, round(config.seconds * config.rate))
    samples, scale = binaural_responses(events, binaural, config.rate)
    return Tail(samples, scale, cut_off_energy(events))


def render_direct_paths(
    walls: NDArray[np.float64],
    source: NDArray[np.float64],
    listeners: NDArray[np.float64],
    config: AcousticsConfig,
) -> DirectPaths:
    """Render the first arrivals of one source at all listeners.

    Parameters
    ----------
    walls : array, shape (W, 4)
        `avn.apartments.walls.walls(plan)`; what the sound goes round in `diffraction`.
    source, listeners, config
        As in `render_source`.
    """
    paths = find_paths(config.direct_path, walls, source, listeners)
    # One length in a regime, whether or not a source has listeners behind a wall.
    loss_taps = round(LOSS_SECONDS * config.rate) if config.direct_path == "diffraction" else 1
    return render_paths(paths, head_filters(config.rate), config.rate, loss_taps)


def combine(tail: Tail, first: DirectPaths) -> NDArray[np.float32]:
    """The whole responses, shape (L, 4, 2, T), float32."""
    responses = tail.samples * tail.scale[:, None, None, None]
    length, taps = responses.shape[-1], first.samples.shape[-1]
    for person, onset in enumerate(first.onset):
        kept = max(0, min(taps, length - int(onset)))
        responses[person, ..., onset : onset + kept] += (
            first.samples[person, ..., :kept] * first.scale[person]
        )
    return responses
