"""Layout of recordings as loops: cut, tightened, laid out as repeated events, and levelled."""

import zlib

import numpy as np
from scipy.signal import butter, sosfiltfilt
from sound_packages import RATE, Samples

PEAK = 0.9
SEAM = 0.08  # seconds over which the end of a loop is cross-faded into its beginning
FRAME = 160  # samples: 10 ms
PAUSE = 0.3  # seconds: longer silences are shortened to it
QUIET = 26.0  # dB under the loudest 10 ms that count as silence
JITTER = 0.2  # of the gap between events
LONGEST_EVENT = 1.6  # seconds
LEAST_SECONDS = 2.0


def loop(samples: Samples, start: float, seconds: float) -> Samples:
    """Cut a loop out of a recording; its end is cross-faded into its beginning.

    Parameters
    ----------
    samples : array (n,)
        A recording.
    start, seconds : float
        Begin and greatest length of the cut.
    """
    cut = tightened(filtered(samples[round(start * RATE) :]))
    seam = round(SEAM * RATE)
    cut = cut[: round(seconds * RATE) + seam]
    kept, beyond = cut[:-seam].copy(), cut[-seam:]
    fade = np.sqrt(np.linspace(0, 1, seam))
    kept[:seam] = kept[:seam] * fade + beyond * fade[::-1]
    return levelled(repeated(kept))


def events(pieces: list[Samples], gap: float, seconds: float, name: str) -> Samples:
    """Lay out short events one after another, with gaps of about the same length.

    Parameters
    ----------
    pieces : list of arrays
        Recordings of one event each; they take turns.
    gap : float
        Seconds from the end of an event to the begin of the next, +- 20 %.
    seconds : float
        Least length of the result.
    name : str
        Name of the sound, the seed of the jitter.
    """
    random = np.random.default_rng(zlib.crc32(name.encode()))
    trimmed = [edged(trim(filtered(piece))) for piece in pieces]
    # not quieter than 8 dB under the loudest, so that no cut holds faint events alone
    loudest = max(rms(piece) for piece in trimmed)
    trimmed = [piece * max(1, 0.4 * loudest / rms(piece)) for piece in trimmed]
    parts: list[Samples] = []
    while sum(map(len, parts)) < seconds * RATE or len(parts) // 2 % len(trimmed):
        pause = gap * (1 + JITTER * random.uniform(-1, 1))
        parts += [trimmed[len(parts) // 2 % len(trimmed)], np.zeros(round(pause * RATE))]
    return levelled(np.concatenate(parts))


def filtered(samples: Samples) -> Samples:
    """Remove what is below 40 Hz: offset, rumble and wind."""
    result: Samples = sosfiltfilt(butter(3, 40, "high", fs=RATE, output="sos"), samples)
    return result


def level_in_frames(samples: Samples) -> Samples:
    """Compute the level of each 10 ms in dB under the loudest."""
    frames = np.resize(samples, (max(1, len(samples) // FRAME), FRAME))
    power = (frames**2).mean(axis=1)
    result: Samples = 10 * np.log10(power / power.max() + 1e-12)
    return result


def trim(samples: Samples) -> Samples:
    """Remove silence before and after an event."""
    sounding = np.flatnonzero(level_in_frames(samples) > -QUIET)
    return samples[sounding[0] * FRAME : (sounding[-1] + 1) * FRAME]


def tightened(samples: Samples) -> Samples:
    """Shorten the silences in a recording to 0.3 s, and remove those at its ends."""
    samples = trim(samples)
    silent = level_in_frames(samples) < -QUIET
    longest = round(PAUSE * RATE / FRAME)
    run = np.zeros(len(silent), dtype=int)
    for index, is_silent in enumerate(silent):
        run[index] = (run[index - 1] + 1 if index else 1) if is_silent else 0
    kept = np.repeat(run <= longest, FRAME)
    return samples[: len(kept)][kept]


def edged(samples: Samples) -> Samples:
    """Fade the ends of an event, of at most 1.6 s, over 3 ms and 60 ms."""
    shaped = samples[: round(LONGEST_EVENT * RATE)].copy()
    rise, fall = min(48, len(shaped) // 4), min(960, len(shaped) // 4)
    shaped[:rise] *= np.linspace(0, 1, rise)
    shaped[-fall:] *= np.linspace(1, 0, fall)
    return shaped


def repeated(samples: Samples) -> Samples:
    """Repeat a short loop to at least two seconds."""
    return np.tile(samples, max(1, -int(-LEAST_SECONDS * RATE // len(samples))))


def levelled(samples: Samples) -> Samples:
    """Bring a loop to mean 0 and a peak of 0.9."""
    centred = samples - samples.mean()
    return centred * (PEAK / np.abs(centred).max())


def rms(samples: Samples) -> float:
    """Compute the root mean square."""
    return float(np.sqrt(np.mean(samples**2)))
