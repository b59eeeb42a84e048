"""Print the tables of `docs/acoustics.md` that are measured on the apartments of a split.

The direct-to-reverberant ratio of the impulse responses by line of sight and distance, in both
acoustic regimes, the reverberation time T20 of each apartment, and that within its rooms. Products
that are missing are built. Run from the repository, with settings of ``avn generate`` as arguments:

    python scripts/room_acoustics.py outputs=outputs
"""

from __future__ import annotations

import sys
from collections import defaultdict
from itertools import chain, pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

import avn
from avn.acoustics.decay import reverberation_time
from avn.dataset.scene import AudibleScene

REGIMES = ("resonance", "diffraction")
SUBSETS = {"validation": "val", "test": "room"}
DISTANCES = (0.0, 2.0, 4.0, 6.0, 8.0, np.inf)  # metres, ends of the groups
FEWEST = 20  # pairs that a median is printed of
OCTAVES = (500, 1000, 2000)  # Hz, of which T20 is the mean
STEP = 0.001  # seconds, to which the energy is summed before a decay is fitted


def ratios(scene: AudibleScene) -> NDArray[np.float64]:
    """Return the direct-to-reverberant ratio of each source and cell in dB, (K, C)."""
    direct, reverberation = scene.brirs.energies()
    result: NDArray[np.float64] = 10 * np.log10(direct / reverberation)
    return result


def distances(scene: AudibleScene, heights: float = 0.5) -> NDArray[np.float64]:
    """Return the lengths of the straight lines from sources to receivers in metres, (K, C)."""
    centres = scene.grid.centres
    plan = np.linalg.norm(centres[scene.sources][:, None] - centres[None], axis=-1)
    return np.hypot(plan, heights)


def median_text(values: NDArray[np.float64], reference: float = 0.0) -> str:
    """Format a median in dB; that of few pairs says nothing."""
    return f"{np.median(values) - reference:+.1f} dB" if len(values) >= FEWEST else "-"


def print_ratios(scenes: dict[str, list[AudibleScene]]) -> None:
    """Print the median ratios in and out of sight, in all and by distance."""
    print("| acoustics | distance | in sight | out of sight | difference | pairs in / out |")
    print("| --- | --- | --- | --- | --- | --- |")
    for regime, own in scenes.items():
        ratio = np.concatenate([ratios(scene).ravel() for scene in own])
        away = np.concatenate([distances(scene).ravel() for scene in own])
        seen = np.concatenate([scene.in_sight.ravel() for scene in own])
        ends = [(0.0, np.inf), *pairwise(DISTANCES)]
        for low, high in ends:
            near = (away >= low) & (away < high)
            name = f"{low:g} to {high:g} m".replace(" to inf m", " m and more")
            one, other = (ratio[near & where] for where in (seen, ~seen))
            few = min(len(one), len(other)) < FEWEST
            difference = "-" if few else median_text(other, float(np.median(one)))
            print(
                f"| `{regime}` | {'all' if (low, high) == ends[0] else name} | {median_text(one)} "
                f"| {median_text(other)} | {difference} | {len(one)} / {len(other)} |"
            )


def decay_times(scene: AudibleScene, every: int = 2) -> NDArray[np.float64]:
    """Return T20 in seconds of every second cell and each source, mean of three octaves."""
    cells = torch.arange(0, scene.grid.cells, every)
    times = []
    for source in range(len(scene.sources)):
        heard = scene.brirs.gather(torch.full_like(cells, source), 4 * cells).numpy()
        energies = []
        for centre in OCTAVES:
            edges = (centre / np.sqrt(2), centre * np.sqrt(2))
            sections = butter(3, edges, "bandpass", fs=16000, output="sos")
            squares = sosfiltfilt(sections, heard) ** 2
            size = round(STEP * 16000)
            kept = squares.shape[-1] // size * size
            energies.append(squares[..., :kept].reshape(*squares.shape[:2], -1, size).sum((1, 3)))
        for bands in zip(*energies, strict=True):
            times.append(np.mean([reverberation_time(band, STEP, -5, -25) for band in bands]))
    return np.array(times)


def decay_times_within_rooms(scene: AudibleScene, every: int = 2) -> dict[str, list[float]]:
    """Return the median T20 in the own room of each source, by kind of room and floor."""
    cells = np.arange(0, scene.grid.cells, every)
    times = decay_times(scene, every).reshape(len(scene.sources), len(cells))
    found: dict[str, list[float]] = defaultdict(list)
    for source, own in zip(scene.sources, times, strict=True):
        index = scene.grid.rooms[source]
        room = scene.plan.rooms[index]
        within = own[scene.grid.rooms[cells] == index]
        found[f"{room.kind}, {room.floor}"].append(float(np.nanmedian(within)))
    return found


def print_decay_times_within_rooms(scenes: list[AudibleScene]) -> None:
    """Print the median and the range over sources of T20 in the room of the source."""
    found: dict[str, list[float]] = defaultdict(list)
    for scene in scenes:
        for name, times in decay_times_within_rooms(scene).items():
            found[name] += times
    print("| room, floor | T20 within it, median | range | sources |")
    print("| --- | --- | --- | --- |")
    for name, times in [*sorted(found.items()), ("all", list(chain(*found.values())))]:
        ends = f"{min(times):.2f} to {max(times):.2f} s"
        print(f"| {name} | {np.median(times):.2f} s | {ends} | {len(times)} |", flush=True)


def print_decay_times(scenes: list[AudibleScene]) -> None:
    """Print the median and the range of T20 of each apartment."""
    print("| apartment | T20, median | 5th to 95th percentile |")
    print("| --- | --- | --- |")
    for scene in scenes:
        times = decay_times(scene)
        low, middle, high = np.nanpercentile(times, (5, 50, 95))
        print(f"| `{scene.name}` | {middle:.2f} s | {low:.2f} to {high:.2f} s |", flush=True)


def main() -> None:
    """Print the tables."""
    given = sys.argv[1:]
    every: dict[str, list[AudibleScene]] = {}
    for regime in REGIMES:
        overrides = [*given, f"acoustics={regime}"]
        every[regime] = [avn.load_scene(name, overrides) for name in avn.scene_names(given)]
    for title, prefix in SUBSETS.items():
        print(f"\nDirect-to-reverberant ratio, {title} apartments:\n")
        print_ratios(
            {
                regime: [scene for scene in own if scene.name.startswith(prefix)]
                for regime, own in every.items()
            }
        )
    print()
    print_decay_times(every["resonance"])
    print()
    print_decay_times_within_rooms(every["resonance"])


if __name__ == "__main__":
    main()
