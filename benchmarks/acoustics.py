"""Time, memory and agreement of the acoustic engine and of pyroomacoustics' ray tracing.

Both trace one source of the same furnished apartment: same surfaces, absorption, receivers (one
cell in `--every`), number of rays, radius of receivers, length, bins of 4 ms and least energy of a
ray, without absorption by air and without a limit on the number of reflections. Each line compares
the same product in the same setting, and the levels and T20 beside a time are those of the same
runs:

- energies: the energy over time in six bands at each receiver;
- responses: impulse responses made of these energies. pyroomacoustics makes one omnidirectional
  response for each pair, this engine those of both ears in four headings, with the direct sound of
  both regimes: eight.

Without scattering the engines agree. With scattering, pyroomacoustics gives scattered energy to
receivers twice, once as diffuse rain to every receiver at every reflection, and once with the ray
that goes on: in a shoebox of absorption 0.1 its level is 0.0 dB from ours at scattering 0 and
2.7 dB above at 1, where ours agrees with the energy balance (`tests/acoustics/test_level.py`). Its
time is then mostly that of the rain, so that ratio compares two methods, which do not agree.

Each engine runs in processes of its own, in turn, and reports user time of the processor and peak
memory; times are medians over `--repeats`. The last line is this engine with its default settings,
which has no counterpart.

Run from the repository: ``python benchmarks/acoustics.py``.
"""

import argparse
import dataclasses
import multiprocessing
import resource
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

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
RADIUS = 0.25  # metres
UNLIMITED = 100_000  # reflections of a ray; its energy and the time end it before


@dataclass
class Cost:
    """User time of the processor for one pair, in seconds, and peak memory in MB."""

    seconds: float
    megabytes: float


@dataclass
class Outcome:
    """Costs of one engine, and what it measures at L receivers."""

    energies: Cost
    responses: Cost
    decays: NDArray[np.float64]  # (L,), s, mean of 500 to 2,000 Hz; NaN where it is not measured
    levels: NDArray[np.float64]  # (L,), dB


class Meter:
    """Meter of the user time since it was made, for one of a number of pairs, and of memory."""

    def __init__(self, pairs: int) -> None:
        self._pairs, self._begin = pairs, self._used().ru_utime

    @staticmethod
    def _used() -> resource.struct_rusage:
        return resource.getrusage(resource.RUSAGE_SELF)

    def read(self) -> Cost:
        """Return the cost so far."""
        used = self._used()
        return Cost((used.ru_utime - self._begin) / self._pairs, used.ru_maxrss / 1024)


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


def run_ours(plan: FloorPlan, every: int, rays: int, scattered: bool) -> Outcome:
    """Trace the energies, then render the responses from the start."""
    surfaces, source, receivers, seen = scene_geometry(plan)
    receivers, seen = receivers[::every], seen[::every]
    scattering = None if scattered else np.zeros((len(surfaces.materials), 6))
    config = AcousticsConfig(
        seconds=SECONDS, rays=rays, depth=UNLIMITED, receiver_radius=RADIUS, air=False
    )
    # compiles, or loads what is compiled
    render_source(surfaces, source, receivers[:4], dataclasses.replace(config, rays=100))
    meter = Meter(len(receivers))
    events = trace(
        surfaces, source, receivers, rays=rays, depth=UNLIMITED, seconds=SECONDS, radius=RADIUS,
        scattering=scattering, air=False,
    )  # fmt: skip
    histograms = events.histogram(STEP)
    energies = meter.read()
    meter = Meter(len(receivers))
    render_source(surfaces, source, receivers, config, scattering=scattering)
    for regime in ("transmission", "diffraction"):
        own = dataclasses.replace(config, name="benchmark", direct_path=regime)
        render_direct_paths(walls(plan), source, receivers, own)
    responses = meter.read()
    paths = find_paths("transmission", walls(plan), source, receivers)
    direct = band_energies(paths, air=False)
    energy = histograms.sum(axis=1) + direct * seen[:, None]
    levels = 10 * np.log10(energy.mean(axis=1))
    return Outcome(energies, responses, decay_times(histograms, STEP), levels)


def run_default(plan: FloorPlan) -> Cost:
    """Render the responses of all cells with the default settings."""
    surfaces, source, receivers, _ = scene_geometry(plan)
    config = AcousticsConfig()
    render_source(surfaces, source, receivers[:4], config)
    meter = Meter(len(receivers))
    render_source(surfaces, source, receivers, config)
    render_direct_paths(walls(plan), source, receivers, config)
    return meter.read()


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


def run_theirs(plan: FloorPlan, every: int, rays: int, scattered: bool) -> Outcome:
    """Trace with pyroomacoustics; its histograms hold the direct sound."""
    surfaces, source, receivers, _ = scene_geometry(plan)
    receivers = receivers[::every]
    room = pra.Room(
        peer_walls(surfaces, plan, scattered), fs=16000, max_order=-1, ray_tracing=True,
        air_absorption=False,
    )  # fmt: skip
    room.set_ray_tracing(
        n_rays=rays, receiver_radius=RADIUS, hist_bin_size=STEP, time_thres=SECONDS,
        energy_thres=1e-8,
    )  # fmt: skip
    # its own test and volume fail where boxes stand on a floor; the volume sets echo densities
    room.is_inside = lambda *_, **__: True
    room.get_volume = lambda: sum(2.6 * (own.x1 - own.x0) * (own.y1 - own.y0) for own in plan.rooms)
    room.add_source(source)
    room.add_microphone_array(receivers.T)
    meter = Meter(len(receivers))
    room.ray_tracing()
    energies = meter.read()
    room.compute_rir()
    responses = meter.read()
    # A source of energy 1 gives 1 / D^2 there and 1 / (4 pi D^2) here.
    bins = round(SECONDS / STEP)
    histograms = np.stack([np.asarray(h[0][0]).T[:bins] for h in room.rt_histograms])
    energy = histograms.sum(axis=1).mean(axis=1) / (4 * np.pi)
    return Outcome(energies, responses, decay_times(histograms, STEP), 10 * np.log10(energy))


def in_own_process(run: Callable[..., Any], *arguments: object) -> Any:
    """Run in a new process, so that its peak memory can be measured."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(run, arguments)


def median(outcomes: list[Outcome], product: str) -> Cost:
    """Return the median time and the greatest memory of a product."""
    costs = [getattr(outcome, product) for outcome in outcomes]
    return Cost(
        float(np.median([cost.seconds for cost in costs])), max(cost.megabytes for cost in costs)
    )


def agreement(ours: Outcome, theirs: Outcome, near: NDArray[np.bool_]) -> str:
    """Describe the agreement of the engines, in the source's room and elsewhere."""
    parts = []
    for where, subset in (("source's room", near), ("other rooms", ~near)):
        decays = [np.nanmedian(outcome.decays[subset]) for outcome in (ours, theirs)]
        off = (ours.levels - theirs.levels)[subset]
        parts.append(
            f"{where} level {off.mean():+.1f} dB (spread {off.std():.1f} dB), "
            f"median T20 {decays[0]:.2f} s and {decays[1]:.2f} s "
            f"({100 * (decays[0] / decays[1] - 1):+.0f} %)"
        )
    return "; ".join(parts)


def compare(plan: FloorPlan, options: argparse.Namespace, scattered: bool) -> None:
    """Run both engines in turn in one setting and print a line for each product."""
    grid = build_grid(plan)
    rooms = grid.rooms[:: options.every]
    near = rooms == grid.rooms[source_cells(plan, grid)[0]]
    setting = (plan, options.every, options.rays, scattered)
    ours, theirs = [], []
    for _ in range(options.repeats):
        ours.append(in_own_process(run_ours, *setting))
        theirs.append(in_own_process(run_theirs, *setting))
    made = {
        "energies": "energies of both",
        "responses": "8 responses of avn, 1 of pyroomacoustics",
    }
    agreed = agreement(ours[0], theirs[0], near)
    for product, description in made.items():
        one, other = median(ours, product), median(theirs, product)
        print(
            f"scattering {'on' if scattered else 'off'}, {options.rays} rays, no limit of order, "
            f"{len(rooms)} receivers, {description}: avn {1000 * one.seconds:.2f} ms a pair, "
            f"{one.megabytes:.0f} MB; pyroomacoustics {1000 * other.seconds:.2f} ms a pair, "
            f"{other.megabytes:.0f} MB; pyroomacoustics takes {other.seconds / one.seconds:.2f} "
            f"times as long; avn against it: {agreed}",
            flush=True,
        )


def main() -> None:
    """Measure both without and with scattering, and this engine with its default settings."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="of the apartment")
    parser.add_argument("--every", type=int, default=6, help="one cell in so many is a receiver")
    parser.add_argument("--rays", type=int, default=10000, help="rays of both engines")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each engine and setting")
    options = parser.parse_args()
    plan = generate(options.seed, "benchmark")
    print(f"apartment: {len(build_surfaces(plan).axis)} rectangles, {build_grid(plan).cells} cells")
    for scattered in (False, True):
        compare(plan, options, scattered)
    costs = [in_own_process(run_default, plan) for _ in range(options.repeats)]
    print(
        f"avn with its default settings ({AcousticsConfig().rays} rays, scattering and air on, all "
        f"cells, 8 responses): {1000 * float(np.median([own.seconds for own in costs])):.2f} ms a "
        f"pair, {max(own.megabytes for own in costs):.0f} MB"
    )


if __name__ == "__main__":
    main()
