"""Families of sounds of bells, beeps, buzzers and clocks that are synthesised from parameters.

Each function takes a random generator and parameters, and returns a loop of whole periods at
16 kHz.
Levels are arbitrary: `sound_layout.levelled` follows.
"""

import numpy as np
from sound_packages import RATE, Samples

Random = np.random.Generator


def seconds(length: float) -> Samples:
    """Return the times of the samples of a length in seconds."""
    return np.arange(round(length * RATE)) / RATE


def add(loop: Samples, sound: Samples, at: float) -> None:
    """Add a sound to a loop at a time in seconds; it continues at the loop's beginning."""
    index = (round(at * RATE) + np.arange(len(sound))) % len(loop)
    np.add.at(loop, index, sound)


def band(noise: Samples, low: float, high: float) -> Samples:
    """Filter to a band in Hz, circularly, so that a loop stays one."""
    spectrum = np.fft.rfft(noise)
    hertz = np.fft.rfftfreq(len(noise), 1 / RATE)
    edges = 1 / (1 + (low / np.maximum(hertz, 1e-3)) ** 6) / (1 + (hertz / high) ** 6)
    result: Samples = np.fft.irfft(spectrum * edges, len(noise))
    return result


def strike(modes: list[float], decays: list[float], levels: list[float], length: float) -> Samples:
    """Sound of a struck body: decaying sines of given frequencies, decay times and levels."""
    time = seconds(length)
    parts = zip(modes, decays, levels, strict=True)
    tone = sum(level * np.sin(2 * np.pi * f * time) * np.exp(-time / d) for f, d, level in parts)
    fade = np.minimum(1, (length - time) / 0.02)
    return np.asarray(tone * np.minimum(1, time / 0.001) * fade)


def bell(hertz: float, decay: float, length: float, ratios: tuple[float, ...]) -> Samples:
    """One stroke of a bell or tube with the given ratios of partials."""
    modes = [hertz * ratio for ratio in ratios if hertz * ratio < 7500]
    decays = [decay / ratio**0.7 for ratio in ratios[: len(modes)]]
    return strike(modes, decays, [1 / (1 + 0.5 * k) for k in range(len(modes))], length)


GONG = (1.0, 2.32, 4.25, 6.63)  # a hemispherical shell
TUBE = (1.0, 1.5, 2.0, 2.76, 5.40)  # a tubular bell
BAR = (1.0, 3.98, 9.38)  # a free bar


def ringing_bell(
    random: Random, gongs: tuple[float, ...], rate: float, decay: float, on: float, off: float
) -> Samples:
    """Electric bell: a clapper strikes gongs in turn for a while, and pauses."""
    loop = np.zeros(round(2 * (on + off) * RATE))
    for burst in range(2):
        for stroke in range(int(on * rate)):
            at = burst * (on + off) + (stroke + random.uniform(-0.04, 0.04)) / rate
            level = random.uniform(0.85, 1)
            hertz = gongs[stroke % len(gongs)]
            add(loop, level * bell(hertz, decay, min(6 * decay, on + off), GONG), max(at, 0))
    return loop


def warble(
    random: Random, tones: tuple[float, ...], rate: float, on: float, off: float, edge: float
) -> Samples:
    """Electronic ringer: tones alternate at a rate; `edge` 0 is a sine, 1 a square wave."""
    time = seconds(2 * (on + off))
    step = (time * rate).astype(int) % len(tones)
    phase = np.cumsum(np.take(tones, step)) / RATE
    wave = sum(
        edge ** (k - 1) / k * np.sin(2 * np.pi * k * phase) * (np.take(tones, step) * k < 7500)
        for k in (1, 3, 5, 7)
    )
    gate = (time % (on + off)) < on
    return np.asarray(wave * smooth(gate.astype(float), 0.004))


def melody(random: Random, notes: str, beat: float, edge: float, decay: float) -> Samples:
    """Melody of MIDI numbers, `-` for a rest, each of one beat; a note decays."""
    numbers = notes.split()
    loop = np.zeros(round(len(numbers) * beat * RATE))
    for index, number in enumerate(numbers):
        if number == "-":
            continue
        hertz = 440 * 2 ** ((int(number) - 69) / 12)
        ratios = (1.0, 3.0, 5.0) if edge else (1.0, 2.0)
        levels = [1.0, edge / 3, edge / 5] if edge else [1.0, 0.2]
        kept = [(r, v) for r, v in zip(ratios, levels, strict=False) if r * hertz < 7500]
        modes, volumes = [r * hertz for r, _ in kept], [v for _, v in kept]
        add(loop, strike(modes, [decay] * len(kept), volumes, min(3 * decay, 1.5)), index * beat)
    return loop


def smooth(gate: Samples, width: float) -> Samples:
    """Smooth a gate by a moving mean, circularly."""
    count = max(1, round(width * RATE))
    kernel = np.zeros(len(gate))
    kernel[:count] = 1 / count
    result: Samples = np.fft.irfft(np.fft.rfft(gate) * np.fft.rfft(kernel), len(gate))
    return result


def beeps(
    random: Random, hertz: float, on: float, off: float, count: int, pause: float, edge: float
) -> Samples:
    """Beeper: groups of beeps with a pause after each group."""
    group = count * (on + off) + pause
    time = seconds(max(1, round(3 / group)) * group)
    within = time % group
    gate = ((within % (on + off)) < on) & (within < count * (on + off))
    harmonics = [k for k in (1, 2, 3, 4, 5) if k * hertz < 7500]
    wave = sum(edge ** (k - 1) * np.sin(2 * np.pi * k * hertz * time) for k in harmonics)
    return np.asarray(wave * smooth(gate.astype(float), 0.003))


def siren(random: Random, low: float, high: float, period: float, shape: float) -> Samples:
    """Siren: a tone sweeps up and down; `shape` is the share of the period that it rises."""
    periods = max(2, round(3 / period))
    cycle = seconds(periods * period) % period / period
    rise = np.where(cycle < shape, cycle / shape, (1 - cycle) / max(1 - shape, 1e-3))
    hertz = low * (high / low) ** rise
    phase = np.cumsum(hertz) / RATE
    phase *= np.round(phase[-1]) / phase[-1]  # whole turns, so that it loops
    return np.asarray(sum(0.4**k * np.sin(2 * np.pi * (k + 1) * phase) for k in range(3)))


def buzzer(random: Random, hertz: float, tilt: float, on: float, off: float) -> Samples:
    """Buzzer: all harmonics of a low tone, rising or falling by a power of their number."""
    time = seconds(max(1, round(2.5 / (on + off))) * (on + off))
    wave = np.zeros(len(time))
    for k in range(1, int(6500 / hertz)):
        phase = random.uniform(0, 2 * np.pi)
        wave += (
            k**tilt / (1 + (k * hertz / 2500) ** 4) * np.sin(2 * np.pi * k * hertz * time + phase)
        )
    return wave * smooth(((time % (on + off)) < on).astype(float), 0.01)


def ticking(
    random: Random, modes: tuple[float, ...], decay: float, rate: float, lower: float, noise: float
) -> Samples:
    """Clock that ticks `rate` times a second; every other tick is lower by a factor."""
    count = 2 * max(4, round(1.5 * rate))
    loop = np.zeros(round(count / rate * RATE))
    for index in range(count):
        factor = lower if index % 2 else 1.0
        tones = [factor * mode * random.uniform(0.99, 1.01) for mode in modes]
        levels = [1 / (1 + k) for k in range(len(tones))]
        tick = strike(tones, [decay / (1 + k) for k in range(len(tones))], levels, 8 * decay)
        click = random.standard_normal(len(tick)) * np.exp(-seconds(8 * decay)[: len(tick)] / 0.002)
        add(loop, random.uniform(0.8, 1) * (tick + noise * click), index / rate)
    return loop


def chimes(
    random: Random, notes: tuple[float, ...], gap: float, decay: float, ratios: tuple[float, ...]
) -> Samples:
    """Chime: notes in Hz struck one after another, with a gap in seconds; 0 is a rest."""
    loop = np.zeros(round(len(notes) * gap * RATE))
    for index, hertz in enumerate(notes):
        if hertz:
            stroke = bell(hertz, decay, min(4 * decay, 3.0), ratios)
            add(loop, stroke + 0.3 * tap(random, 0.004, len(stroke)), index * gap)
    return loop


def tap(random: Random, decay: float, length: int) -> Samples:
    """Short noise of a hammer."""
    return random.standard_normal(length) * np.exp(-np.arange(length) / RATE / decay)


def cuckoo(random: Random, high: float, low: float, breath: float, gap: float) -> Samples:
    """Cuckoo clock: two falling notes of a whistle."""
    call = np.zeros(round(gap * RATE))
    for hertz, at, length in ((high, 0.0, 0.22), (low, 0.32, 0.34)):
        time = seconds(length)
        shape = np.sin(np.pi * np.minimum(time / length, 1)) ** 0.4
        tone = np.sin(2 * np.pi * hertz * time) + 0.15 * np.sin(4 * np.pi * hertz * time)
        add(call, shape * (tone + breath * random.standard_normal(len(time))), at)
    return np.tile(call, 3)
