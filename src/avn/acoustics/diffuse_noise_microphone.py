"""Microphones with noise of the surroundings, and with levels that differ from clip to clip."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import isfinite

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.acoustics.diffuse_noise import diffuse_noise
from avn.acoustics.dry_sounds import load_sounds
from avn.acoustics.microphone import ClipNoise, Microphone
from avn.acoustics.sound_table import packaged_sounds
from avn.core.errors import UserError

# Name of white noise among the recordings.
WHITE = "white"
_SECONDS = 20  # of white noise
_FADE = 0.01  # seconds of cross-fade at the wrap-around of a clip
_MOST = 200.0  # decibels


class DiffuseNoiseMicrophone(Microphone):
    """Two microphones in a diffuse field of noise, with random levels of sound and noise.

    Of each clip are drawn its level, its signal-to-noise ratio and the kind of its noise. The
    ratio is that of the power of the clip's sound, averaged over both ears, to the power of the
    noise over its whole recording. The noise of the microphones themselves is added after it.

    Parameters
    ----------
    level : (float, float)
        Least and greatest level of the sound, dB relative to the usual one, -200 to 200.
    snr : (float, float)
        Least and greatest signal-to-noise ratio, dB, -200 to 200.
    noises : sequence of str
        Kinds of noise: "white", and names of recordings of the package, see docs/sounds.md.
    silent : float
        Share of the clips without the sound, 0 to 1; their noise is as loud as with it.
    noise_rms, gain : float
        See `Microphone`.

    Raises
    ------
    UserError
        If a value is out of range, or a recording is unknown.
    """

    def __init__(
        self,
        level: Sequence[float] = (0.0, 0.0),
        snr: Sequence[float] = (10.0, 10.0),
        noises: Sequence[str] = (WHITE,),
        silent: float = 0.0,
        noise_rms: float = 0.005,
        gain: float = 1.0,
    ) -> None:
        super().__init__(noise_rms, gain)
        self.level, self.snr, self.noises = (
            _range("level", level),
            _range("snr", snr),
            tuple(noises),
        )
        if not 0 <= silent <= 1:
            raise UserError(f"microphone.silent: {silent}; give a share, 0 to 1")
        self.silent = silent
        if not self.noises:
            raise UserError(f"microphone.noises: empty; give at least one, such as {WHITE}")
        for name in self.noises:
            if name != WHITE and name not in packaged_sounds():
                raise UserError(
                    f"microphone.noises: '{name}' is neither {WHITE} nor a recording of the "
                    "package; docs/sounds.md lists them"
                )

    def record(self, clips: Tensor, noise: ClipNoise) -> Tensor:
        """Record clips; may change them in place. See `Microphone.record`."""
        level, ratio = (
            low + (high - low) * noise.uniform(draw)
            for draw, (low, high) in enumerate((self.level, self.snr))
        )
        power = clips.square().mean((1, 2))
        scale = (power * 10 ** (-ratio / 10)).sqrt()
        if self.silent:
            clips *= (noise.uniform(4) >= self.silent)[:, None, None]
        clips += scale[:, None, None] * self._surroundings(noise, clips.shape[-1])
        # the level of the sound and of the noise around it, against that of the microphone's own
        clips *= 10 ** (level / 20)[:, None, None]
        return super().record(clips, noise)

    def _surroundings(self, noise: ClipNoise, rate: int) -> Tensor:
        """Return circular seconds of noise of RMS 1, (N, 2, rate)."""
        fade = round(_FADE * rate)
        kinds, places = noise.integers(2) % len(self.noises), noise.integers(3)
        rise = torch.arange(1, fade + 1, dtype=torch.float32) / (fade + 1)
        found = torch.empty(len(kinds), 2, rate, device=kinds.device)
        for kind, name in enumerate(self.noises):
            rows = (kinds == kind).nonzero()[:, 0]
            if not len(rows):
                continue
            bank = _bank(name, rate).to(kinds.device)
            pieces = bank.unfold(1, rate + fade, 1)
            cut = pieces[:, places[rows] % pieces.shape[1]].transpose(0, 1)
            second = cut[..., :rate].clone()
            # equal power, as the two ends of the cut are independent
            second[..., :fade] *= rise.sqrt()
            second[..., :fade] += cut[..., rate:] * (1 - rise).sqrt()
            found[rows] = second
        return found


def _range(key: str, values: Sequence[float]) -> tuple[float, float]:
    numbers = [float(value) for value in values]
    valid = len(numbers) == 2 and all(isfinite(value) and abs(value) <= _MOST for value in numbers)
    if not valid or numbers[0] > numbers[1]:
        raise UserError(
            f"microphone.{key}: {list(values)}; give the least and the greatest in dB, such as "
            "[-6, 6]"
        )
    return numbers[0], numbers[1]


@lru_cache(maxsize=64)
def _bank(name: str, rate: int) -> Tensor:
    """Return a looped recording as noise of a diffuse field, (2, n), a second longer than it is."""
    return torch.from_numpy(_looped(diffuse_noise(_recording(name, rate), rate), rate))


def _recording(name: str, rate: int) -> NDArray[np.float32]:
    if name == WHITE:
        random = np.random.default_rng(0)
        return random.standard_normal(_SECONDS * rate).astype(np.float32)
    return load_sounds({name: name}, rate)[name]


def _looped(noise: NDArray[np.float32], rate: int) -> NDArray[np.float32]:
    length = noise.shape[1] + rate + round(_FADE * rate)
    return np.ascontiguousarray(noise[:, np.arange(length) % noise.shape[1]])
