"""Time and memory of `renderer=raycast` against other ways to see an apartment without a screen.

Peers, each used where it is installed: pybullet's TinyRenderer, a rasteriser on one thread that
draws the same triangles in plain colours with shadows of one lamp, and Blender's Cycles, which
follows the light of the same scene (`renderer=cycles`). The cameras and the size are the same, and
the pictures are not: pybullet's have no textures, no indirect light and one sample a pixel, and
Cycles' have the noise of few samples removed. So a ratio says what another kind of picture costs.
The apartment is the first of the training apartments of `var`. Ours counts the baking of light once
an apartment, spread over its views. All run in this process and report its processor time.

Run from the repository: ``python benchmarks/views.py``.
"""

import argparse
import importlib.util
import math
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import load_split
from avn.views.cycles import Cycles
from avn.views.raycast import Raycast
from avn.views.scene_mesh import scene_mesh
from avn.views.settings import CyclesConfig, RaycastConfig


def timed(make, *arguments):
    """Return the result of a call and its processor time in seconds."""
    begin = time.process_time()
    made = make(*arguments)
    return made, time.process_time() - begin


def run_raycast(plan, centres, headings, views):
    """Measure seconds for each view, with and without its share of the lighting."""
    Raycast(RaycastConfig(), generate(1, "small", 1, "small"), "train").views(
        centres[:1] * 0 + 1, headings[:1]
    )  # compiles, or loads what is compiled
    (renderer, opened) = timed(Raycast, RaycastConfig(), plan, "train")
    _, baked = timed(renderer.prepare)
    _, seen = timed(renderer.views, centres, headings)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    alone = seen / len(centres)
    whole = alone + (opened + baked) / views
    print(
        f"raycast: {alone * 1000:.0f} ms a view, {opened + baked:.1f} s to open and light an "
        f"apartment of {views} views, {whole * 1000:.0f} ms a view in all; {memory:.0f} MB, "
        f"{len(renderer.mesh)} triangles"
    )
    return whole


def run_cycles(plan, centres, headings):
    """Measure seconds for each view of Blender, without its start."""
    renderer = Cycles(CyclesConfig(), plan, "train")
    renderer.views(centres[:1], headings[:1])
    return timed(renderer.views, centres, headings)[1] / len(centres)


def run_pybullet(plan, centres, headings):
    """Seconds a view of pybullet's software rasteriser."""
    import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    vertices = scene_mesh(plan, "train").mesh.vertices.reshape(-1, 3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "apartment.obj"
        with path.open("w") as file:
            np.savetxt(file, vertices, "v %.4f %.4f %.4f")
            np.savetxt(file, np.arange(len(vertices)).reshape(-1, 3) + 1, "f %d %d %d")
        shape = pybullet.createVisualShape(pybullet.GEOM_MESH, fileName=str(path))
        pybullet.createMultiBody(baseVisualShapeIndex=shape)
    projection = pybullet.computeProjectionMatrixFOV(90, 1.0, 0.02, 30)

    def draw():
        for centre, heading in zip(centres, headings, strict=True):
            turn = math.pi / 2 * heading
            eye = np.array((*centre, 1.5))
            to = eye + np.array((math.sin(turn), math.cos(turn), -math.tan(math.pi / 6)))
            view = pybullet.computeViewMatrix(eye, to, (0, 0, 1))
            pybullet.getCameraImage(
                128, 128, view, projection, renderer=pybullet.ER_TINY_RENDERER, shadow=1
            )

    draw_seconds = timed(draw)[1]
    pybullet.disconnect(client)
    return draw_seconds / len(centres)


def main():
    """Print seconds a view and ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--views", type=int, default=48, help="views that are timed")
    arguments = parser.parse_args()
    plan = load_split(SplitConfig(folder="var"))["train"][0]
    grid = build_grid(plan)
    states = np.linspace(0, 4 * grid.cells - 1, arguments.views).astype(int)
    centres, headings = grid.centres[states // 4], states % 4
    ours = run_raycast(plan, centres, headings, 4 * grid.cells)
    peers = {
        "pybullet": ("pybullet", run_pybullet, "plain colours, one lamp"),
        "Cycles": ("bpy", run_cycles, "the light of each view is followed"),
    }
    for name, (module, run, picture) in peers.items():
        if importlib.util.find_spec(module) is None:
            print(f"{name}: {module} is not installed")
            continue
        theirs = run(plan, centres, headings)
        print(
            f"{name}: {theirs * 1000:.0f} ms a view, {theirs / ours:.1f} times ours, for another "
            f"picture: {picture}"
        )


if __name__ == "__main__":
    main()
