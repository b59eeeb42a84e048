"""Time, memory and agreement of the acoustic engine against pyroomacoustics' ray tracing.

Both trace one source of the same furnished apartment, with the same surfaces, absorption and
scattering: pyroomacoustics with 2,000 rays, this engine with its default. The time of this engine
includes all that it computes for a pair (reverberation and direct path, both ears, four headings);
that of pyroomacoustics ends with the energy histogram, before any impulse response. Each runs in a
process of its own, which reports its processor time and peak memory. The memory of pyroomacoustics
is proportional to the number of receivers, so it gets every `--every`-th cell.

Agreement is also measured without scattering, since pyroomacoustics gives scattered energy to
receivers twice, once as diffuse rain and once with the ray that goes on: in a shoebox of absorption
0.1 its level is 0.0 dB from ours at scattering 0 and 2.7 dB above at 1, where ours agrees with the
energy balance.

Run from the repository: ``python benchmarks/acoustics.py``.
"""

import argparse
import multiprocessing
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pyroomacoustics as pra
from numpy.typing import NDArray

from avn.acoustics import materials
from avn.acoustics.brir import render_direct_paths, render_source
from avn.acoustics.decay import reverberation_time
from avn.acoustics.direct_path import band_energies, find_paths
from avn.acoustics.settings import AcousticsConfig
from avn.acoustics.tracer import trace
from avn.apartments.floor_plan import FloorPlan
from avn.apartments.generator import generate
from avn.apartments.grid import build_grid, source_cells
from avn.apartments.surfaces import Surfaces, build_surfaces, line_of_sight
from avn.apartments.walls import walls

STEP = 0.004  # seconds, the bins of pyroomacoustics' histograms
SECONDS = 0.6


@dataclass
class Outcome:
    """Time, memory and results of one engine for L receivers."""

    seconds: float  # of the processor, for a pair
    megabytes: float
    decays: NDArray[np.float64]  # (L,), s, mean of 500 to 2,000 Hz; NaN where it is not measured
    levels: NDArray[np.float64]  # (L,), dB


def peak_megabytes() -> float:
    """Return the peak memory of this process in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def scene_geometry(plan: FloorPlan) -> tuple[Surfaces, NDArray, NDArray, NDArray]:
    """Return the surfaces, first source, receivers on all cells, and those in line of sight."""
    surfaces, grid = build_surfaces(plan), build_grid(plan)
    source = np.array([*grid.centres[source_cells(plan, grid)[0]], 1.0])
    receivers = np.column_stack([grid.centres, np.full(len(grid.centres), 1.5)])
    seen = line_of_sight(surfaces, np.broadcast_to(source, receivers.shape).copy(), receivers)
    return surfaces, source, receivers, seen


def decay_times(histograms: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Compute T20 of energies (L, bins, 6), mean over 500, 1,000 and 2,000 Hz."""
    times = [
        [reverberation_time(histogram[:, band], step, -5, -25) for band in (2, 3, 4)]
        for histogram in histograms
    ]
    return np.mean(times, axis=1)


def run_ours(plan: FloorPlan, stride: int, scattered: bool) -> Outcome:
    """Render the responses of all pairs, then measure on the traced energies."""
    surfaces, source, receivers, seen = scene_geometry(plan)
    config = AcousticsConfig(seconds=SECONDS, air=False)
    render_source(surfaces, source, receivers[:4], config)  # compiles, or loads what is compiled
    begin = time.process_time()
    render_source(surfaces, source, receivers, config)
    render_direct_paths(walls(plan), source, receivers, config)
    taken, memory = time.process_time() - begin, peak_megabytes()
    subset = receivers[::stride]
    scattering = None if scattered else np.zeros((len(surfaces.materials), 6))
    events = trace(
        surfaces, source, subset, rays=40000, seconds=SECONDS, air=False, scattering=scattering
    )
    direct = band_energies(find_paths("transmission", walls(plan), source, subset))
    histograms = events.histogram(STEP)
    energy = histograms.sum(axis=1) + direct * seen[::stride, None]
    decays = decay_times(histograms, STEP)
    return Outcome(taken / len(receivers), memory, decays, 10 * np.log10(energy.mean(axis=1)))


def in_air(plan: FloorPlan, points: NDArray) -> NDArray[np.bool_]:
    """Test points (N, 3) for being inside a room or doorway and outside of all furniture."""
    solid = np.zeros(len(points), dtype=bool)
    for block in walls(plan):
        solid |= ((points[:, :2] > block[:2]) & (points[:, :2] < block[2:])).all(axis=1)
    for piece in plan.furniture:
        x0, y0, x1, y1 = piece.bounds
        low, high = np.array([x0, y0, piece.z]), np.array([x1, y1, piece.z + piece.height])
        solid |= ((points > low) & (points < high)).all(axis=1)
    return ~solid & (points[:, 2] > 0) & (points[:, 2] < 2.6)


def peer_walls(surfaces: Surfaces, plan: FloorPlan, scattered: bool) -> list:
    """Convert surfaces to walls of pyroomacoustics, with normals that point out of the air."""
    absorbed = materials.absorption(surfaces.materials)
    roughness = materials.scattering(surfaces.materials) * scattered
    reflectors = []
    for quad in range(len(surfaces.axis)):
        axis = int(surfaces.axis[quad])
        u, v = (i for i in range(3) if i != axis)
        (a0, b0), (a1, b1) = surfaces.lower[quad], surfaces.upper[quad]
        corners = np.empty((3, 4))
        corners[axis] = surfaces.offset[quad]
        corners[u], corners[v] = [a0, a1, a1, a0], [b0, b0, b1, b1]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
        ahead = corners.mean(axis=1) + 1e-3 * normal / np.linalg.norm(normal)
        if in_air(plan, ahead[None])[0]:
            corners = corners[:, ::-1]
        row = surfaces.material[quad]
        outline = np.ascontiguousarray(corners)
        reflectors.append(pra.wall_factory(outline, absorbed[row], roughness[row], str(quad)))
    return reflectors


def run_theirs(plan: FloorPlan, stride: int, scattered: bool, rays: int = 2000) -> Outcome:
    """Trace with pyroomacoustics; its histograms hold the direct sound."""
    surfaces, source, receivers, _ = scene_geometry(plan)
    receivers = receivers[::stride]
    room = pra.Room(
        peer_walls(surfaces, plan, scattered), fs=16000, max_order=0, ray_tracing=True,
        air_absorption=False,
    )  # fmt: skip
    room.set_ray_tracing(
        n_rays=rays, receiver_radius=0.25, hist_bin_size=STEP, time_thres=SECONDS,
        energy_thres=1e-8,
    )  # fmt: skip
    room.is_inside = lambda *_, **__: True  # its own test fails where boxes stand on a floor
    room.add_source(source)
    room.add_microphone_array(receivers.T)
    begin = time.process_time()
    room.ray_tracing()
    taken = time.process_time() - begin
    # A source of energy 1 gives 1 / D^2 there and 1 / (4 pi D^2) here.
    bins = round(SECONDS / STEP)
    histograms = np.stack([np.asarray(h[0][0]).T[:bins] for h in room.rt_histograms])
    energy = histograms.sum(axis=1).mean(axis=1) / (4 * np.pi)
    decays = decay_times(histograms, STEP)
    return Outcome(taken / len(receivers), peak_megabytes(), decays, 10 * np.log10(energy))


def in_own_process(run: Callable[..., Outcome], *arguments: object, **named: object) -> Outcome:
    """Run in a new process, so that its peak memory can be measured."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(run, arguments, named)


def compare(what: str, ours: Outcome, theirs: Outcome, near: NDArray[np.bool_]) -> None:
    """Print the agreement of the engines, in the source's room and elsewhere."""
    for where, subset in (("source's room", near), ("other rooms", ~near)):
        decays = [np.nanmean(outcome.decays[subset]) for outcome in (ours, theirs)]
        off = (ours.levels - theirs.levels)[subset]
        print(
            f"{what}, {where}: T20 {decays[0]:.2f} s against {decays[1]:.2f} s "
            f"({100 * (decays[0] / decays[1] - 1):+.0f} %), level {off.mean():+.1f} dB "
            f"(spread {off.std():.1f} dB)"
        )


def main() -> None:
    """Measure both and print the ratio, the memory and the agreement."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="of the apartment")
    parser.add_argument("--every", type=int, default=6, help="one cell in so many for the peer")
    options = parser.parse_args()
    plan = generate(options.seed, "benchmark")
    surfaces, source, receivers, _ = scene_geometry(plan)
    grid = build_grid(plan)
    rooms = grid.rooms[:: options.every]
    near = rooms == grid.rooms[np.argmin(np.linalg.norm(receivers[:, :2] - source[:2], axis=1))]
    print(f"apartment: {len(surfaces.axis)} rectangles, {len(receivers)} receivers for each source")
    ours = in_own_process(run_ours, plan, options.every, True)
    theirs = in_own_process(run_theirs, plan, options.every, True)
    for name, outcome in (("avn", ours), ("pyroomacoustics", theirs)):
        print(f"{name}: {1000 * outcome.seconds:.1f} ms a pair, peak {outcome.megabytes:.0f} MB")
    print(f"ratio: {theirs.seconds / ours.seconds:.1f} times faster (wanted: at least 5)")
    compare("same scattering", ours, theirs, near)
    mirrors = in_own_process(run_ours, plan, options.every, False)
    peers = in_own_process(run_theirs, plan, options.every, False, rays=10000)
    compare("no scattering", mirrors, peers, near)


if __name__ == "__main__":
    main()
