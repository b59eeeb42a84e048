"""Binaural room impulse responses of one source: reverberation and direct path.

The response of receiver l in heading h is ``samples[l, h] * scale[l]`` of the reverberation, plus
the direct path from its onset on. Both contain the time of flight.
"""

import hashlib
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from avn.acoustics import materials
from avn.acoustics.direct_path import LOSS_SECONDS, REGIMES, DirectPaths, find_paths, render_paths
from avn.acoustics.heads import DEFAULT, head_content, head_filters, load_head
from avn.acoustics.rendering import Binaural, binaural_responses
from avn.acoustics.settings import AcousticsConfig
from avn.acoustics.tracer import Events, trace
from avn.apartments.surfaces import Surfaces
from avn.core.errors import UserError

# Direct path of the regimes of these names.
REGIME_OF = {"resonance": "transmission", "diffraction": "diffraction"}


def check_config(config: AcousticsConfig, node: str = "acoustics") -> AcousticsConfig:
    """Check a config and return it.

    Parameters
    ----------
    config : AcousticsConfig
        Settings.
    node : str
        Name of the config's node, for messages.

    Raises
    ------
    UserError
        If a value is out of range or there is no such head; the message names the key below `node`
        and the valid values.
    """
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
    load_head(config.head, f"{node}.head")
    return config


@dataclass(frozen=True)
class Reverberation:
    """Reverberation (all reflections) of one source at L receivers.

    Attributes
    ----------
    samples : (L, 4, 2, T) int16
        Heading, ear (0 left, 1 right), sample; `samples * scale` is the response.
    scale : (L,) float32
        0 where nothing arrives.
    cut_db : (L,) float32
        Energy of the reverberation after T samples, in dB of all of it, measured on rays that
        are followed for 1.5 times as long; -inf where there is none.
    """

    samples: NDArray[np.int16]
    scale: NDArray[np.float32]
    cut_db: NDArray[np.float32]


@lru_cache(maxsize=4)
def _binaural(rate: int, samples: int, head: str) -> Binaural:
    return Binaural.prepare(head_filters(rate, head), samples, rate)


def assets_hash(head: str = DEFAULT, key: str = "acoustics.head") -> str:
    """Compute a hash of the tables that responses depend on: materials and HRIRs.

    Parameters
    ----------
    head : str
        The setting `head` of `AcousticsConfig`; a file enters by its content.
    key : str
        Key of the setting, for messages.

    Raises
    ------
    UserError
        If there is no such head.
    """
    tables = (materials.absorption(materials.NAMES), materials.scattering(materials.NAMES))
    content = hashlib.sha256(repr(materials.NAMES).encode())
    for table in tables:
        content.update(np.ascontiguousarray(table).tobytes())
    content.update(head_content(head, key))
    return content.hexdigest()


def cut_off_energy(events: Events) -> NDArray[np.float32]:
    """Compute the energy after `events.seconds` in dB of all, shape (L,), summed over bands."""
    late = events.distance >= events.seconds * materials.SPEED_OF_SOUND
    energy = events.energy.sum(axis=1, dtype=np.float64)
    receiver_count = len(events.starts) - 1
    receiver = events.receiver()
    total = np.bincount(receiver, weights=energy, minlength=receiver_count)
    after = np.bincount(receiver[late], weights=energy[late], minlength=receiver_count)
    share = np.divide(after, total, out=np.zeros(receiver_count), where=total > 0)
    with np.errstate(divide="ignore"):
        return (10 * np.log10(share)).astype(np.float32)


def render_source(
    surfaces: Surfaces,
    source: NDArray[np.float64],
    receivers: NDArray[np.float64],
    config: AcousticsConfig,
    absorption: NDArray[np.float64] | None = None,
    scattering: NDArray[np.float64] | None = None,
) -> Reverberation:
    """Trace one source and render the reverberation at all receivers.

    Runs on one thread; to use more cores, distribute sources over processes. The bytes depend on
    the arguments alone.

    Parameters
    ----------
    surfaces : Surfaces
        Reflecting rectangles of the scene.
    source : array, shape (3,)
        Position, metres.
    receivers : array, shape (L, 3)
        Positions of the head's centre, metres.
    config : AcousticsConfig
        Settings.
    absorption, scattering : array, shape (len(surfaces.materials), 6), optional
        Coefficients in place of those of `avn.acoustics.materials`.
    """
    events = trace(
        surfaces,
        source,
        receivers,
        rays=config.rays,
        depth=config.depth,
        seconds=config.seconds,
        seed=config.seed,
        radius=config.receiver_radius,
        absorption=absorption,
        scattering=scattering,
        air=config.air,
    )
    binaural = _binaural(config.rate, round(config.seconds * config.rate), config.head)
    samples, scale = binaural_responses(events, binaural, config.rate)
    return Reverberation(samples, scale, cut_off_energy(events))


def render_direct_paths(
    walls: NDArray[np.float64],
    source: NDArray[np.float64],
    receivers: NDArray[np.float64],
    config: AcousticsConfig,
) -> DirectPaths:
    """Render the direct paths of one source to all receivers.

    Parameters
    ----------
    walls : array, shape (W, 4)
        `avn.apartments.walls.walls(plan)`, metres; obstacles in `diffraction`.
    source, receivers, config
        As in `render_source`.
    """
    paths = find_paths(config.direct_path, walls, source, receivers)
    # One length for all sources of a regime, with or without diffracted paths.
    attenuated = config.air or config.direct_path == "diffraction"
    loss_taps = round(LOSS_SECONDS * config.rate) if attenuated else 1
    filters = head_filters(config.rate, config.head)
    return render_paths(paths, filters, config.rate, loss_taps, config.air)


def combine(reverberation: Reverberation, direct_path: DirectPaths) -> NDArray[np.float32]:
    """Add reverberation and direct paths to whole responses, shape (L, 4, 2, T), float32."""
    responses = reverberation.samples * reverberation.scale[:, None, None, None]
    length, taps = responses.shape[-1], direct_path.samples.shape[-1]
    for receiver, onset in enumerate(direct_path.onset):
        kept = max(0, min(taps, length - int(onset)))
        responses[receiver, ..., onset : onset + kept] += (
            direct_path.samples[receiver, ..., :kept] * direct_path.scale[receiver]
        )
    return responses
