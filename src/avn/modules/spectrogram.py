"""Binaural log-power spectrograms with interaural coherence, the input of audio networks."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from avn.core.errors import UserError

# Lower bound of the power before the logarithm, below the microphone's noise floor in any band.
POWER_FLOOR = 1e-12
# Clips that are transformed at once.
TOGETHER = 8


class Spectrogram(nn.Module):
    """Log-power spectrograms of both ears, pooled into frequency bands.

    Parameters
    ----------
    rate : int
        Sampling rate in hertz; a clip is one second long.
    stft_window : float
        Length of the Hann window in seconds, at least two samples and at most 1 s.
    bands : int
        Number of frequency bands, 1 to half of the window's samples.
    frames : int
        Number of time frames, a divisor of `rate`.
    scale : {"mel", "linear"}
        Frequency scale on which the bands are spaced evenly.
    interaural : bool
        Whether two channels are added: real and imaginary part of the interaural coherence of each
        band and frame. Its phase holds the interaural time difference, and its magnitude falls
        with reverberation; power spectra hold neither.

    Raises
    ------
    UserError
        Where a parameter is out of range.
    """

    band_weights: Tensor
    hann: Tensor

    def __init__(
        self,
        rate: int = 16000,
        stft_window: float = 0.032,
        bands: int = 64,
        frames: int = 64,
        scale: str = "linear",
        interaural: bool = True,
    ) -> None:
        super().__init__()
        window = round(stft_window * rate)
        _check(rate, window, bands, frames, scale)
        self.rate, self.window, self.frames, self.bands = rate, window, frames, bands
        self.interaural = interaural
        # Computed from the config, so not part of a checkpoint.
        self.register_buffer("hann", torch.hann_window(window), persistent=False)
        weights = band_weights(rate, window, bands, scale)
        self.register_buffer("band_weights", weights, persistent=False)

    @property
    def channels(self) -> int:
        """Number of channels: 2, or 4 with interaural coherence."""
        return 4 if self.interaural else 2

    def forward(self, clips: Tensor) -> Tensor:
        """Compute the spectrograms of N clips.

        The absolute level is kept: a clip that is 20 dB louder has values higher by 2.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Left and right ear. A clip is periodic: its end joins its start.

        Returns
        -------
        (N, channels, bands, frames) float32 tensor
            Left and right power in units of 10 dB, shifted by 4 to be near 0 for typical clips;
            with `interaural`, then the coherence, -1 to 1.
        """
        # In small batches, so that intermediate results stay in a CPU's caches: twice as fast.
        return torch.cat([self._pictures(part) for part in clips.split(TOGETHER)])

    def power(self, clips: Tensor, frames: int) -> Tensor:
        """Return the power of each band in some frames of clips, (N, 2, bands, frames).

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Waveforms of the left and the right ear.
        frames : int
            Number of frames, a divisor of those of a spectrogram.
        """
        spectra = self._stft(clips, self.frames // frames)
        values = spectra.real.square() + spectra.imag.square()
        return (values @ self.band_weights).transpose(-1, -2)

    def _pictures(self, clips: Tensor) -> Tensor:
        """Map clips (N, 2, rate) to spectrograms (N, channels, bands, frames)."""
        spectra = self._stft(clips)
        real, imaginary = spectra.real.contiguous(), spectra.imag.contiguous()
        values = real.new_empty(len(clips), self.channels, *real.shape[2:])
        values[:, :2] = real.square().addcmul_(imaginary, imaginary)
        if self.interaural:
            # Left times the conjugate of right.
            (left, right), (left_i, right_i) = real.unbind(1), imaginary.unbind(1)
            values[:, 2] = (left * right).addcmul_(left_i, right_i)
            values[:, 3] = (left_i * right).addcmul_(left, right_i, value=-1.0)
        pooled = (values @ self.band_weights).transpose(-1, -2)
        power = pooled[:, :2]
        pooled[:, 2:] /= (power[:, 0] * power[:, 1]).sqrt().clamp_min(POWER_FLOOR)[:, None]
        pooled[:, :2] = torch.log10(power.clamp_min(POWER_FLOOR)) + 4.0
        return pooled

    def _stft(self, clips: Tensor, every: int = 1) -> Tensor:
        """Map clips (N, 2, rate) to complex spectra (N, 2, frames / every, stft_window / 2 + 1)."""
        hop = self.rate // self.frames
        # The clip is circular, so its start follows its end and no edge needs padding.
        around = torch.cat((clips, clips[..., : self.window]), -1)
        windows = around.unfold(-1, self.window, hop)[..., : self.frames : every, :]
        # The scale makes the sum over bins the mean square of the signal.
        scale = math.sqrt(2.0 / (self.window * float(self.hann.square().sum())))
        return torch.fft.rfft(windows * (self.hann * scale))

    def mirror(self, pictures: Tensor) -> Tensor:
        """Return the spectrograms of the same clips with the ears exchanged.

        Parameters
        ----------
        pictures : (N, C, bands, frames) tensor
            Spectrograms as `forward` gives them; channels that follow are kept.

        Returns
        -------
        (N, C, bands, frames) tensor
            Left and right exchanged; the interaural phase changes its sign.
        """
        left, right, *others = pictures.unbind(1)
        if self.interaural:
            others[1] = -others[1]
        return torch.stack((right, left, *others), 1)


def band_weights(rate: int, window: int, bands: int, scale: str) -> Tensor:
    """Compute the triangular filter bank that pools STFT bins into bands.

    The mel scale is that of O'Shaughnessy, 2595 log10(1 + f / 700). A triangle narrower than
    the spacing of bins is widened to it, so that no band is empty.

    Parameters
    ----------
    rate : int
        Sampling rate in hertz.
    window : int
        Length of the window in samples.
    bands : int
        Number of bands.
    scale : {"mel", "linear"}
        Frequency scale on which the bands are spaced evenly.

    Returns
    -------
    (window / 2 + 1, bands) float32 tensor
        Weights of each bin in each band.
    """
    bins = torch.linspace(0.0, rate / 2, window // 2 + 1, dtype=torch.float64)
    top = rate / 2
    if scale == "mel":
        mel = torch.linspace(0.0, 2595 * math.log10(1 + top / 700), bands + 2, dtype=torch.float64)
        edges = 700 * (10 ** (mel / 2595) - 1)
    else:
        edges = torch.linspace(0.0, top, bands + 2, dtype=torch.float64)
    spacing = rate / window
    centres = edges[1:-1]
    below = (centres - edges[:-2]).clamp_min(spacing)
    above = (edges[2:] - centres).clamp_min(spacing)
    offset = bins[:, None] - centres
    triangle = torch.where(offset < 0, 1 + offset / below, 1 - offset / above)
    return triangle.clamp_min(0.0).float()


def _check(rate: int, window: int, bands: int, frames: int, scale: str) -> None:
    where = "spectrogram"
    if scale not in ("mel", "linear"):
        raise UserError(f"{where}.scale is '{scale}'; give mel or linear")
    if not 2 <= window <= rate:
        raise UserError(f"{where}.stft_window is {window / rate:g}; give {2 / rate:g} to 1 second")
    if frames < 1 or rate % frames:
        raise UserError(f"{where}.frames is {frames}; give a divisor of {rate}, such as 64")
    if not 1 <= bands <= window // 2:
        raise UserError(
            f"{where}.bands is {bands}; give 1 to {window // 2}, half the samples of the window"
        )
