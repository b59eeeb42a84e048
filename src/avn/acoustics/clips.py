"""Clips: one second of binaural audio in the steady state, rendered in batches.

A clip is a second of the looped dry sound, from a random position and with a random circular phase,
circularly convolved with a binaural room impulse response (BRIR), plus the noise of a microphone.
The sound is in its steady state: it has no onset that would reveal the time of flight.

All random numbers of a clip are a pure function of integers (seed, purpose, source, state, sound,
realisation) by a counter-based hash, so any clip can be rendered alone or in any batch.
"""

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

import numpy as np
import soundfile
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import pad

from avn.acoustics.counter_hash import absorb, integers
from avn.acoustics.dry_sounds import RATE
from avn.acoustics.microphone import Microphone
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.files import atomic_write

PURPOSES = ("train", "eval")

FADE_SECONDS = 0.01  # cross-fade from the end of a second to its beginning
HOP_SECONDS = 0.01  # grid of the positions at which a second may begin
LEAST_LEVEL = 0.5  # of the usual level of the sound: -6 dB
NOISE_SAMPLES = 1 << 19  # 33 s of noise for each ear
EXPORT_FACTOR = 0.1
_FIRST_DRAW = 2  # draws of a clip before those of its microphone: position and phase


class DrySounds:
    """Bank of looped dry sounds, from which seconds are cut in batches.

    Seconds of less than half the usual level of the sound are never drawn, so that the pauses of
    a long recording are left out. Each sound is scaled so that the seconds that can be drawn have
    unit RMS on average. For a steady sound that is the RMS of the recording; pauses do not
    raise the level of the rest.

    Parameters
    ----------
    sounds : mapping
        Name to float array (n,) with n >= rate, as `load_sounds` gives it.
    device : torch.device or str
        Device of the bank and of the seconds.
    rate : int
        Sampling rate of the sounds in Hz; a clip has as many samples.
    """

    def __init__(
        self,
        sounds: Mapping[str, NDArray[np.float32]],
        device: torch.device | str = "cpu",
        rate: int = RATE,
    ) -> None:
        self.names, self.rate = tuple(sounds), rate
        self._fade = fade_samples(rate)
        waves, places, offset = [], [], 0
        for samples in sounds.values():
            looped, starts = _prepare(samples, rate)
            waves.append(looped)
            places.append(starts + offset)
            offset += len(looped)
        longest = max(map(len, places))
        table = np.stack([np.resize(starts, longest) for starts in places])
        self._wave = torch.from_numpy(np.concatenate(waves)).to(device)
        self._places = torch.from_numpy(table).to(device)
        self._counts = torch.tensor([len(starts) for starts in places], device=device)
        # Keys depend on the name alone, so that clips do not depend on the bank's other sounds.
        keys = [
            int.from_bytes(sha256(name.encode()).digest()[:8], "little", signed=True)
            for name in self.names
        ]
        self.keys = torch.tensor(keys, dtype=torch.int64, device=device)
        ramp = torch.arange(1, self._fade + 1, dtype=torch.float32, device=device)
        self._fade_in = ramp / (self._fade + 1)

    def __len__(self) -> int:
        """Return the number of sounds."""
        return len(self.names)

    def seconds(self, sound: Tensor, place: Tensor, phase: Tensor) -> Tensor:
        """Cut one circular second for each clip.

        Parameters
        ----------
        sound : int64 tensor, shape (N,)
            Index into ``names``.
        place, phase : int64 tensor, shape (N,)
            Non-negative random integers. Their remainders give the position in the recording
            and the circular shift in samples.

        Returns
        -------
        float32 tensor, shape (N, rate)
            Continuous at the wrap-around by a cross-fade of 10 ms.
        """
        rate, fade = self.rate, self._fade
        starts = self._places[sound, place % self._counts[sound]]
        cut = self._wave.unfold(0, rate + fade, 1)[starts]
        second, beyond = cut[:, :rate], cut[:, rate:]
        second[:, :fade].mul_(self._fade_in).add_(beyond * (1 - self._fade_in))
        twice = torch.cat([second, second], dim=1).flatten()
        rows = torch.arange(len(sound), device=twice.device) * (2 * rate)
        return twice.unfold(0, rate, 1)[rows + phase % rate]


class ClipRenderer:
    """Renderer of clips of a bank of sounds, with one microphone, seed and purpose.

    Parameters
    ----------
    sounds : DrySounds
        The bank; clips are rendered on its device.
    microphone : Microphone
        Microphones at the ears.
    seed : int
        Seed of all random draws.
    purpose : {"train", "eval"}
        The two have independent random numbers.

    Raises
    ------
    ValueError
        If the purpose is another word.
    """

    def __init__(self, sounds: DrySounds, microphone: Microphone, seed: int, purpose: str) -> None:
        self.sounds = sounds
        self.microphone = microphone
        device = sounds.keys.device
        words = torch.tensor([int(seed), PURPOSES.index(purpose)], device=device)
        self._key = absorb(torch.zeros((), dtype=torch.int64, device=device), words)
        # One half of the noise for each ear, so that the two are independent.
        random = np.random.default_rng([int(seed) % 2**64, PURPOSES.index(purpose)])
        noise = random.standard_normal((2, NOISE_SAMPLES))
        self._noise = torch.from_numpy(noise.astype(np.float32)).to(device)

    def render(
        self,
        spectra: Tensor,
        clip: ClipId,
        index: Tensor | None = None,
    ) -> Tensor:
        """Render clips.

        Parameters
        ----------
        spectra : complex64 tensor, shape (N, 2, rate / 2 + 1)
            `brir_spectra` of each clip's BRIR; (M, 2, rate / 2 + 1) with ``index``.
        clip : ClipId
            Identity of the clips. The sound is an index into the bank's names; the other fields
            only enter the random numbers.
        index : int64 tensor, shape (N,), optional
            Row of ``spectra`` for each clip.

        Returns
        -------
        float32 tensor, shape (N, 2, rate)
            Left and right ear. 16 to 128 clips a call are fastest on a CPU, for its caches.
        """
        return self.record(self.at_ears(spectra, clip, index), clip)

    def at_ears(self, spectra: Tensor, clip: ClipId, index: Tensor | None = None) -> Tensor:
        """Render the sound at the ears in the steady state, without microphones. See `render`."""
        dry = torch.fft.rfft(self._dry(clip))
        used = spectra if index is None else spectra[index]
        return torch.fft.irfft(dry[:, None, :] * used, n=self.sounds.rate)

    def between(self, brirs: Tensor, clip: ClipId, begin: Tensor, end: Tensor) -> Tensor:
        """Render the sound at the ears of sources that begin or end.

        The sound of the clip, repeated every second, is switched on and off, and convolved with
        the response of the place where it is heard. What was emitted in earlier seconds is heard
        as far as the response lasts: the first silent second has the reverberant tail.

        Parameters
        ----------
        brirs : float32 tensor, shape (N, 2, T)
            Responses of the place of the clip.
        clip : ClipId
            Identity of the clips.
        begin, end : float64 tensor, shape (N,)
            Seconds between which the source emits sound, relative to the beginning of the clip.

        Returns
        -------
        float32 tensor, shape (N, 2, rate)
        """
        rate, samples = self.sounds.rate, brirs.shape[-1]
        before = -(-samples // rate) * rate  # samples before the clip that are still heard
        times = torch.arange(-before, rate, dtype=torch.float64, device=brirs.device) / rate
        emitted = (times >= begin[:, None]) & (times < end[:, None])
        dry = self._dry(clip).repeat(1, before // rate + 1) * emitted
        # the size of the transform keeps the end of the convolution off the clip
        size = dry.shape[-1]
        found = torch.fft.irfft(torch.fft.rfft(dry)[:, None] * torch.fft.rfft(brirs, n=size), size)
        return found[..., before:].contiguous()

    def record(self, sound: Tensor, clip: ClipId) -> Tensor:
        """Return what the microphones record of the sound at the ears; may change it in place.

        Parameters
        ----------
        sound : float32 tensor, shape (N, 2, rate)
            As of `at_ears`.
        clip : ClipId
            Identity of the clips, for the noise.
        """
        return self.microphone.record(
            sound, _Noise(self._noise, self.sounds.rate, self._keys(clip))
        )

    def _keys(self, clip: ClipId) -> Tensor:
        words = torch.stack(clip._replace(sound=self.sounds.keys[clip.sound]), dim=-1)
        return absorb(self._key, words.to(torch.int64))

    def _dry(self, clip: ClipId) -> Tensor:
        key = self._keys(clip)
        place, phase = (integers(key, draw) for draw in range(_FIRST_DRAW))
        return self.sounds.seconds(clip.sound, place, phase)


class _Noise:
    """Random numbers of N clips; see `avn.acoustics.microphone.ClipNoise`."""

    def __init__(self, bank: Tensor, rate: int, key: Tensor) -> None:
        self._bank, self._rate, self._key = bank, rate, key

    def __call__(self, ear: int) -> Tensor:
        """Return noise of RMS 1 for an ear, (N, rate) float32."""
        pieces = self._bank[ear].unfold(0, self._rate, 1)
        return pieces[integers(self._key, _FIRST_DRAW + ear) % len(pieces)]

    def integers(self, draw: int) -> Tensor:
        """Return further random integers of the clips, (N,) int64."""
        return integers(self._key, _FIRST_DRAW + 2 + draw)

    def uniform(self, draw: int) -> Tensor:
        """Return further random numbers of 0 to 1, (N,) float32."""
        return self.integers(draw).double().div_(2.0**63).float()


def brir_spectra(brirs: Tensor, rate: int = RATE) -> Tensor:
    """Compute the spectra of BRIRs over one second, for `ClipRenderer.render`.

    Parameters
    ----------
    brirs : float32 tensor, shape (N, 2, T)
        A response longer than a second is folded to one second, which is exact in the steady
        state of a sound that repeats every second.
    rate : int
        Sampling rate in Hz.

    Returns
    -------
    complex64 tensor, shape (N, 2, rate / 2 + 1)
    """
    samples = brirs.shape[-1]
    if samples > rate:
        folds = -(-samples // rate)
        padded = pad(brirs, (0, folds * rate - samples))
        brirs = padded.unflatten(-1, (folds, rate)).sum(dim=-2)
    return torch.fft.rfft(brirs, n=rate)


def export_wav(path: str | Path, clip: Tensor | NDArray[np.float32], rate: int = RATE) -> None:
    """Write a clip as a stereo WAV file of 16 bits, whole or not at all.

    Parameters
    ----------
    path : str or Path
        The file; its folder is made if it is missing. ``~`` is the home directory.
    clip : array or tensor, shape (2, n)
        Left and right ear. Samples are multiplied by 0.1, the same for every clip, so that levels
        compare; samples beyond full scale are clipped.
    rate : int
        Sampling rate in Hz.

    Raises
    ------
    UserError
        If the file cannot be written.
    """
    target = Path(path).expanduser()
    samples = clip.detach().cpu().numpy() if isinstance(clip, Tensor) else np.asarray(clip)
    scaled = np.clip(EXPORT_FACTOR * samples.T, -1.0, 1.0)
    try:
        with atomic_write(target) as part:
            soundfile.write(part, scaled, rate, format="WAV", subtype="PCM_16")
    except soundfile.SoundFileError as error:
        raise UserError(f"{target} cannot be written ({error}); choose another place") from None


def fade_samples(rate: int) -> int:
    """Return the length of the cross-fade in samples at a sampling rate in Hz."""
    return round(FADE_SECONDS * rate)


def _prepare(
    samples: NDArray[np.float32], rate: int
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Loop a sound far enough for any second, and list the positions at which one may begin.

    Returns the scaled wave, longer by a second and a fade, and the positions (P,) within it.
    """
    wave = np.asarray(samples, dtype=np.float64)
    looped = np.resize(wave, len(wave) + rate + fade_samples(rate))
    energy = np.concatenate([[0.0], np.cumsum(looped**2)])
    starts = np.arange(0, len(wave), round(HOP_SECONDS * rate))
    power = (energy[starts + rate] - energy[starts]) / rate
    # The usual power is a mean weighted by the power itself: pauses do not count, and the
    # loudest second is never below it.
    usual = (power**2).sum() / power.sum()
    loud = power >= LEAST_LEVEL**2 * usual
    level = np.sqrt(power[loud].mean())
    return (looped / level).astype(np.float32), starts[loud]
