"""Families of sounds of water, motors, animals, knocks and fire; see `sound_synthesis`."""

import numpy as np
from scipy.signal import butter, lfilter, sosfilt
from sound_packages import RATE, Samples
from sound_synthesis import BAR, Random, add, band, bell, seconds, strike, tap


def bubbles(
    random: Random, rate: float, low: float, high: float, decay: float, length: float
) -> Samples:
    """Water drops: `rate` rising decaying sines a second, between two frequencies in Hz."""
    loop = np.zeros(round(length * RATE))
    for at in (
        np.arange(int(rate * length)) + random.uniform(-0.3, 0.3, int(rate * length))
    ) / rate:
        hertz = low * (high / low) ** random.uniform()
        time = seconds(6 * decay)
        phase = hertz * (time + 0.8 * time**2)
        sound = np.sin(2 * np.pi * phase) * np.exp(-time / decay) * np.minimum(1, time / 0.001)
        add(loop, random.uniform(0.4, 1) * sound, at % length)
    return loop


def whistle(
    random: Random,
    hertz: tuple[float, ...],
    wander: float,
    breath: float,
    boil: float,
    slide: float,
) -> Samples:
    """Kettle that whistles: tones that wander, breath noise around them, and boiling below."""
    length = 3.0
    time = seconds(length)
    slow = band(random.standard_normal(len(time)), 0.5, 5)
    slow /= np.abs(slow).max()
    glide = 1 + slide * np.sin(2 * np.pi * time / length)
    sound = np.zeros(len(time))
    for index, tone in enumerate(hertz):
        phase = np.cumsum(tone * glide * (1 + wander * slow)) / RATE
        sound += 0.6**index * np.sin(2 * np.pi * phase * np.round(phase[-1]) / phase[-1])
    hiss = band(random.standard_normal(len(time)), 0.8 * hertz[0], 3 * hertz[0])
    rumble = band(random.standard_normal(len(time)), 80, 500)
    flutter = 1 + 0.3 * slow
    return sound * flutter + breath * hiss / np.std(hiss) + boil * rumble / np.std(rumble)


def boiling(
    random: Random, rate: float, low: float, high: float, rumble: float, rattle: float
) -> Samples:
    """Water that boils: many bubbles, rumble, and a lid that rattles `rattle` times a second."""
    length = 3.0
    loop = bubbles(random, rate, low, high, 0.012, length)
    noise = band(random.standard_normal(len(loop)), 60, 700)
    loop = loop / np.std(loop) + rumble * noise / np.std(noise)
    for at in np.arange(int(rattle * length)) / max(rattle, 1):
        lid = bell(random.uniform(1900, 2300), 0.03, 0.15, BAR)
        add(loop, random.uniform(1, 4) * lid, at + random.uniform(0, 0.5 / max(rattle, 1)))
    return loop


def motor(
    random: Random,
    hertz: float,
    tilt: float,
    air: tuple[float, float, float],
    beat: float,
    depth: float,
) -> Samples:
    """Appliance: harmonics of a motor, noise of air in a band at a level, and a slow modulation.

    `air` is (low, high, level relative to the harmonics); `beat` is the modulation's rate in Hz.
    """
    length = max(3.0, round(3 * beat) / beat if beat else 3.0)
    time = seconds(length)
    hertz = round(hertz * length) / length
    tone = np.zeros(len(time))
    for k in range(1, min(40, int(7000 / hertz))):
        level = k**tilt * random.uniform(0.3, 1)
        tone += level * np.sin(2 * np.pi * k * hertz * time + random.uniform(0, 2 * np.pi))
    noise = band(random.standard_normal(len(time)), air[0], air[1])
    swing = 1 - depth * (0.5 + 0.5 * np.cos(2 * np.pi * beat * time)) if beat else 1.0
    return np.asarray((tone / np.std(tone) + air[2] * noise / np.std(noise)) * swing)


def calls(
    random: Random,
    pitch: tuple[float, ...],
    formants: tuple[float, ...],
    length: float,
    gap: float,
    breath: float,
) -> Samples:
    """Animal that calls: a voice whose pitch follows a contour, through resonances.

    `pitch` are Hz at equal steps of a call of `length` seconds; calls follow after `gap` seconds.
    """
    period = length + gap
    loop = np.zeros(round(4 * period * RATE))
    for index in range(4):
        time = seconds(length)
        contour = np.interp(time, np.linspace(0, length, len(pitch)), pitch)
        contour *= random.uniform(0.93, 1.07)
        phase = np.cumsum(contour) / RATE
        pulse = np.clip(np.sin(2 * np.pi * phase), 0, None) ** 3
        source = pulse - pulse.mean() + breath * random.standard_normal(len(time)) * (0.3 + pulse)
        voice = sum(resonance(source, formant) for formant in formants)
        shape = np.sin(np.pi * np.clip(time / length, 0, 1)) ** 0.5
        add(loop, voice * shape, index * period)
    return loop


def resonance(source: Samples, hertz: float) -> Samples:
    """Filter by one resonance with a width of 15 %."""
    radius = np.exp(-np.pi * 0.15 * hertz / RATE)
    poles = [1, -2 * radius * np.cos(2 * np.pi * hertz / RATE), radius**2]
    filtered: Samples = lfilter([1 - radius], poles, source)
    return filtered


def knocks(
    random: Random, modes: tuple[float, ...], decay: float, rate: float, count: int, pause: float
) -> Samples:
    """Knocks on a panel: groups of `count` at a rate, with a pause after each group."""
    group = count / rate + pause
    loop = np.zeros(round(3 * group * RATE))
    for knock in range(3 * count):
        at = knock // count * group + (knock % count + random.uniform(-0.06, 0.06)) / rate
        tones = [mode * random.uniform(0.97, 1.03) for mode in modes]
        body = strike(
            tones,
            [decay / (1 + 0.4 * k) for k in range(len(tones))],
            [1 / (1 + 0.5 * k) for k in range(len(tones))],
            8 * decay,
        )
        add(
            loop, random.uniform(0.75, 1) * (body + 0.5 * tap(random, 0.003, len(body))), max(at, 0)
        )
    return loop


def crackling(
    random: Random, rate: float, low: float, high: float, roar: float, hiss: float
) -> Samples:
    """Fire: `rate` crackles a second of random loudness in a band, roar below and hiss above."""
    length = 3.0
    loop = np.zeros(round(length * RATE))
    sections = butter(2, [low, high], "band", fs=RATE, output="sos")
    for at in random.uniform(0, length, int(rate * length)):
        size = random.pareto(1.5) + 0.3
        crack = random.standard_normal(480) * np.exp(-np.arange(480) / random.uniform(15, 80))
        add(loop, min(size, 6) * sosfilt(sections, crack), at)
    deep = band(random.standard_normal(len(loop)), 50, 300)
    fine = band(random.standard_normal(len(loop)), 2000, 7000)
    loop /= np.std(loop)
    return loop + roar * deep / np.std(deep) + hiss * fine / np.std(fine)
