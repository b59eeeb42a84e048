"""Ranges and layout of observations, the same in every apartment and for every network."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

# Largest finite float16, in which embeddings are stored.
_HALF = 65504.0


@dataclass(frozen=True)
class ObservationSpec:
    """Range of an observation as environments and external policies receive it.

    Attributes
    ----------
    low, high : float
        Smallest and largest value.
    dtype : torch.dtype
        Type of the values.
    unknown : float
        Value that replaces NaN.
    """

    low: float
    high: float
    dtype: torch.dtype = torch.float32
    unknown: float = 0.0


SPECS = {
    "view": ObservationSpec(0, 255, torch.uint8),
    "depth": ObservationSpec(0.0, 1000.0),
    "visual_embedding": ObservationSpec(-_HALF, _HALF),
    "local_patch": ObservationSpec(0.0, 1.0, unknown=0.5),
    "map": ObservationSpec(0.0, 1.0),
    "waveform": ObservationSpec(-1000.0, 1000.0),
    "spectrogram": ObservationSpec(-100.0, 100.0),
    "source_estimate": ObservationSpec(-1000.0, 1000.0),
    "stop_probability": ObservationSpec(0.0, 1.0),
    "audio_embedding": ObservationSpec(-_HALF, _HALF),
    # cells and quarter turns; more than any apartment has
    "odometry": ObservationSpec(-10_000, 10_000, torch.int64),
    "collided": ObservationSpec(0, 1, torch.int8),
}
_OTHER = ObservationSpec(-_HALF, _HALF)


def spec_of(name: str) -> ObservationSpec:
    """Return the range of an observation; that of embeddings if the name is not known."""
    return SPECS.get(name, _OTHER)


def to_spec(name: str, values: Tensor) -> Tensor:
    """Convert observations of N agents from the tables to their range, type and layout.

    Parameters
    ----------
    name : str
        Name of the observation.
    values : (N, ...) tensor
        Values of the tables; `view` is (N, 3, H, W).

    Returns
    -------
    (N, ...) tensor
        `view` is (N, H, W, 3) uint8, `collided` (N, 1) int8 and a scalar (N, 1); NaN is replaced
        and values beyond the range are clipped to it.
    """
    spec = spec_of(name)
    if name == "view":
        values = values.permute(0, 2, 3, 1)
    if values.dim() == 1:
        values = values[:, None]
    values = values.to(spec.dtype)
    if not values.is_floating_point():
        return values
    return values.nan_to_num(nan=spec.unknown).clamp_(spec.low, spec.high)
