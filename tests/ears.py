"""Differences between the ears of binaural responses, and heads of which they are known."""

from pathlib import Path

import numpy as np
import sofar
from scipy.signal import butter, correlate, resample_poly, sosfiltfilt

from avn.acoustics.ambisonics import sh

SPEED = 343.0
RADIUS = 0.0875
FINE = 8


def towards(azimuth, elevation=0.0) -> np.ndarray:
    """Unit vectors (..., 3) in world axes of compass bearings and elevations in degrees."""
    bearing, height = np.broadcast_arrays(np.radians(azimuth), np.radians(elevation))
    flat = np.cos(height)
    return np.stack([np.sin(bearing) * flat, np.cos(bearing) * flat, np.sin(height)], axis=-1)


def heard(ears: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Responses (..., 2, taps) of filters (2, 16, taps) to plane waves from directions."""
    return np.einsum("ect,...c->...et", ears.astype(np.float64), sh(directions))


def time_difference(response: np.ndarray, rate: int) -> float:
    """Microseconds by which the right ear hears earlier, below 1.5 kHz."""
    low = butter(4, 1500, fs=rate, output="sos")
    left, right = sosfiltfilt(low, np.pad(response, ((0, 0), (400, 400))))
    left, right = resample_poly(np.stack([left, right]), FINE, 1, axis=1)
    lag = int(np.argmax(correlate(left, right))) - (len(right) - 1)
    return lag / (FINE * rate) * 1e6


def time_differences(responses: np.ndarray, rate: int) -> np.ndarray:
    """`time_difference` of many responses (M, 2, taps)."""
    return np.array([time_difference(response, rate) for response in responses])


def level_differences(responses: np.ndarray, rate: int) -> np.ndarray:
    """Decibels by which the right ear hears louder from 1.5 to 8 kHz, of responses (..., 2, n)."""
    power = np.abs(np.fft.rfft(responses, 2048)) ** 2
    frequencies = np.fft.rfftfreq(2048, 1 / rate)
    left, right = np.moveaxis(
        power[..., (frequencies >= 1500) & (frequencies < 8000)].sum(axis=-1), -1, 0
    )
    return 10 * np.log10(right / left)


def sphere_points(count: int) -> np.ndarray:
    """Unit vectors (count, 3), evenly over the sphere."""
    height = 1 - (2 * np.arange(count) + 1) / count
    turn, flat = np.arange(count) * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - height**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)


def delays(directions: np.ndarray) -> np.ndarray:
    """Seconds to the left and the right ear of a rigid sphere, (M, 2), Woodworth's formula."""
    cosine = directions[:, :1] * [-1.0, 1.0]
    angle = np.arccos(np.clip(cosine, -1, 1))
    return RADIUS / SPEED * np.where(cosine > 0, -cosine, angle - np.pi / 2)


def gains(directions: np.ndarray, ratio: float = 6.0) -> np.ndarray:
    """Amplitudes at the left and the right ear, (M, 2): up to `ratio` dB louder on their side."""
    return 10 ** (ratio / 20 * directions[:, :1] * [-1.0, 1.0])


def pulses(times: np.ndarray, rate: int, taps: int = 128) -> np.ndarray:
    """Band-limited unit pulses (..., taps) at times in seconds; time 0 is at a quarter."""
    frequencies = np.fft.rfftfreq(taps, 1 / rate)
    phase = np.exp(-2j * np.pi * frequencies * (times[..., None] + taps / 4 / rate))
    return np.fft.irfft(phase, taps)


def head_file(directions: np.ndarray, responses: np.ndarray, rate: int) -> sofar.Sofa:
    """A SOFA object of responses (M, 2, taps) for directions (M, 3)."""
    sofa = sofar.Sofa("SimpleFreeFieldHRIR")
    sofa.Data_IR, sofa.Data_SamplingRate = responses, rate
    east, north, up = directions.T
    azimuth, elevation = np.degrees(np.arctan2(-east, north)) % 360, np.degrees(np.arcsin(up))
    sofa.SourcePosition = np.stack([azimuth, elevation, np.full(len(up), 1.5)], axis=1)
    sofa.SourcePosition_Type, sofa.SourcePosition_Units = "spherical", "degree, degree, metre"
    sofa.ReceiverPosition = np.array([[0.0, RADIUS, 0.0], [0.0, -RADIUS, 0.0]])
    return sofa


def write_head(path: Path, count: int = 300, rate: int = 48000, **changes) -> Path:
    """Write the SOFA file of a sphere with two ears; `changes` are fields of the file."""
    directions = sphere_points(count)
    responses = pulses(delays(directions), rate) * gains(directions)[..., None]
    sofa = head_file(directions, responses, rate)
    for field, value in changes.items():
        setattr(sofa, field, value)
    sofar.write_sofa(str(path), sofa)
    return path
