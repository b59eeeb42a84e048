"""Direction of arrival without learning: steered response power of two ears on a known head."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor, nn

from avn.acoustics.ambisonics import sh
from avn.acoustics.heads import DEFAULT, head_filters
from avn.core.errors import UserError
from avn.core.heard import Arrivals, check_bins

# Least power, against division by zero.
_LEAST = 1e-20
# Difference in level below which ears are alike, dB: exactly in front of a symmetric head and
# behind it there is none, and rounding is no cue.
_ALIKE = 0.1
# Clips that are transformed at once, for the caches of a CPU.
_TOGETHER = 16


class SrpPhat(nn.Module):
    """Model that hears how a sound arrives from its cross-correlation and from the head alone.

    The cross-spectrum of the ears is whitened by the phase transform (Knapp and Carter, "The
    generalized correlation method for estimation of time delay", IEEE Transactions on Acoustics,
    Speech, and Signal Processing 24, 1976), summed over windows, and compared with that of the head
    for each direction: steered response power (DiBiase, "A high-accuracy, low-latency technique for
    talker localization in reverberant environments", thesis, Brown University, 2000), with the
    phases of the head-related responses in place of delays. Levels are compared in addition, since
    phases alone hardly tell front from back. It has no weights. The defaults were chosen on clips
    of validation apartments.

    Parameters
    ----------
    bins : int
        Directions of arrival, a multiple of 4 from 8 to 252.
    low, high : float
        Bounds of the frequencies used, Hz; 0 or more, and no more than half the sampling rate.
    stft_window : float
        Length of the windows, which overlap by half; seconds, 0.01 to 1.
    dynamic : float
        Level below the strongest part of a clip under which parts are noise and left out, dB, more
        than 0 and up to 200. A part is one frequency in one window.
    level_weight : float
        Weight of the score of the levels, 0 to 100; that of the phases is 1.
    temperature : float
        Divisor of the scores before they become probabilities by a softmax, more than 0 and up to
        100.
    metres : float
        Length of the path that is always answered, more than 0 and up to 1000.
    length_sigma : float
        Standard deviation of its logarithm, more than 0 and up to 10.
    head : str
        Head that the agent knows as its own: `ku100`, `kemar` or the path of a SOFA file.
    rate : int
        Sampling rate of the clips in hertz.

    Attributes
    ----------
    trained : bool
        False: there is nothing to train.

    Raises
    ------
    UserError
        If a parameter is out of range.
    """

    trained = False
    _phase: Tensor
    _level: Tensor
    _hann: Tensor

    def __init__(
        self,
        bins: int = 72,
        low: float = 200.0,
        high: float = 8000.0,
        stft_window: float = 0.128,
        dynamic: float = 60.0,
        level_weight: float = 0.2,
        temperature: float = 0.05,
        metres: float = 4.0,
        length_sigma: float = 1.5,
        head: str = DEFAULT,
        rate: int = 16000,
    ) -> None:
        super().__init__()
        check_bins(bins)
        _check(
            {
                "dynamic": (dynamic, 0, 200),
                "temperature": (temperature, 0, 100),
                "metres": (metres, 0, 1000),
                "length_sigma": (length_sigma, 0, 10),
            }
        )
        if not 0 <= level_weight <= 100:
            raise UserError(f"sound_model.level_weight: {level_weight}; give 0 to 100")
        if not 0.01 <= stft_window <= 1:
            raise UserError(f"sound_model.stft_window: {stft_window}; give seconds, 0.01 to 1")
        self.bins, self.dynamic, self.temperature = bins, dynamic, temperature
        self.level_weight = level_weight
        self.metres, self.length_sigma = metres, length_sigma
        self._window = 2 * round(stft_window * rate / 2)
        self._hop = self._window // 2
        self._band = _band(low, high, rate, self._window)
        phase, level = head_differences(bins, rate, self._window, head)
        # Computed from the config, so not part of a checkpoint.
        self.register_buffer("_phase", phase[:, self._band], persistent=False)
        self.register_buffer("_level", level[:, self._band], persistent=False)
        self.register_buffer("_hann", torch.hann_window(self._window), persistent=False)

    @property
    def device(self) -> torch.device:
        """Device on which it computes."""
        return self._hann.device

    def forward(self, clips: Tensor) -> Tensor:
        """Estimate the source locations of N clips, (N, 2): metres to the right and front."""
        return Arrivals(self.arrival(clips)).location

    def arrival(self, clips: Tensor) -> Tensor:
        """Estimate how the sound of N clips arrives.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Waveforms of the left and the right ear.

        Returns
        -------
        (N, bins + 6) float32 tensor
            See `avn.core.heard.Arrivals`. Length and sight are the same for all clips; the location
            lies at that length in the likeliest direction, with the standard deviation that the
            length has to first order.
        """
        scores = torch.cat([self.scores(part) for part in clips.split(_TOGETHER)])
        bearing = (scores / self.temperature).log_softmax(-1)
        angle = scores.argmax(-1) * (2 * math.pi / self.bins)
        others = scores.new_tensor(
            (math.log(self.metres), self.length_sigma, 0.0, self.metres * self.length_sigma)
        ).expand(len(scores), 4)
        place = self.metres * torch.stack((angle.sin(), angle.cos()), 1)
        return torch.cat((bearing, others[:, :3], place, others[:, 3:]), 1)

    def scores(self, clips: Tensor) -> Tensor:
        """Return how well each direction agrees with N clips, (N, bins), in units of the phases'.

        The score of the phases is the mean cosine of their errors. That of the levels is the cosine
        of the angle between the differences in level of the clip and of the head, as vectors over
        frequency; reverberation makes all differences smaller, which does not change the angle.
        """
        left, right = self._spectra(clips).unbind(1)
        cross = left * right.conj()
        power = cross.abs()
        heard = (power > power.amax((1, 2), keepdim=True) * 10 ** (-self.dynamic / 10)).float()
        parts = heard.sum(1)
        white = (cross / power.clamp_min(_LEAST) * heard).sum(1)
        total = parts.sum(1, keepdim=True).clamp_min(1)
        score = (white @ self._phase.conj().T).real / total
        if self.level_weight:
            ears = ((own.abs().square() * heard).sum(1) for own in (left, right))
            level, alike = _decibels(*ears), total * _ALIKE**2
            own = (parts * level.square()).sum(1, keepdim=True) + alike
            norm = (own * (parts @ self._level.square().T + alike)).sqrt()
            score = score + self.level_weight * ((parts * level) @ self._level.T) / norm
        return score

    def _spectra(self, clips: Tensor) -> Tensor:
        """Map clips (N, 2, rate) to spectra of windows (N, 2, windows, frequencies)."""
        # a clip is periodic, so its start follows its end
        around = torch.cat((clips, clips[..., : self._window - self._hop]), -1)
        windows = around.unfold(-1, self._window, self._hop)
        return torch.fft.rfft(windows * self._hann)[..., self._band]


def head_differences(
    bins: int, rate: int, window: int, head: str = DEFAULT
) -> tuple[Tensor, Tensor]:
    """Compute how the ears of the head differ for plane waves from directions around it.

    Parameters
    ----------
    bins : int
        Directions B, clockwise from the front, in the horizontal plane.
    rate : int
        Sampling rate in hertz.
    window : int
        Length of the transform, samples.
    head : str
        See `avn.acoustics.heads.load_head`.

    Returns
    -------
    phase : (B, window / 2 + 1) complex64 tensor
        Cross-spectrum of the left and the right ear, of modulus 1.
    level : (B, window / 2 + 1) float32 tensor
        Level of the left ear above the right one, dB.
    """
    angle = np.arange(bins) * (2 * math.pi / bins)
    directions = np.stack((np.sin(angle), np.cos(angle), np.zeros(bins)), -1)
    filters = head_filters(rate, head, "sound_model.head")[0].astype(np.float64)
    ears = np.einsum("ect,bc->bet", filters, sh(directions))
    left, right = torch.fft.rfft(torch.from_numpy(ears), window).unbind(1)
    cross = left * right.conj()
    phase = cross / cross.abs().clamp_min(_LEAST)
    level = _decibels(left.abs().square(), right.abs().square())
    return phase.to(torch.complex64), level.float()


def _decibels(left: Tensor, right: Tensor) -> Tensor:
    return 10 * torch.log10(left.clamp_min(_LEAST) / right.clamp_min(_LEAST))


def _band(low: float, high: float, rate: int, window: int) -> slice:
    """Return the frequencies of a transform within bounds in Hz."""
    if not 0 <= low < high <= rate / 2:
        raise UserError(
            f"sound_model.low, sound_model.high: {low:g} and {high:g}; give Hz, 0 or more and up "
            f"to {rate / 2:g}, half the sampling rate"
        )
    first, last = math.ceil(low * window / rate), math.floor(high * window / rate)
    if first > last:
        raise UserError(
            f"sound_model.low, sound_model.high: no frequency of {rate / window:g} Hz steps lies "
            f"between {low:g} and {high:g}; give bounds farther apart"
        )
    return slice(first, last + 1)


def _check(given: dict[str, tuple[float, float, float]]) -> None:
    for key, (value, least, most) in given.items():
        if not least < value <= most:
            raise UserError(f"sound_model.{key}: {value}; give more than {least} and up to {most}")
