"""The functions of `import avn`, on the mini split."""

import subprocess
import sys

import numpy as np
import pytest
import torch
from small import SMALL

import avn
from avn.agents.base import Agent
from avn.core.actions import FORWARD, ROTATE_LEFT

ACOUSTICS = [own for own in SMALL if own.startswith(("split", "processes", "acoustics"))]
VIEWS = [own for own in SMALL if own.startswith(("split", "renderer"))]
EPISODES = ["split=mini", "protocol.num_starts=4", "sound=[alarm,clock]"]


@pytest.fixture(scope="module")
def scene(outputs):
    return avn.load_scene(overrides=[*ACOUSTICS, f"outputs={outputs}"])


def test_import_is_light_and_every_public_name_is_there():
    code = "import sys, avn; print({'torch', 'numpy', 'hydra', 'gymnasium'} & sys.modules.keys())"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "set()"
    for name in avn.__all__:
        assert getattr(avn, name) is not None
        assert name in dir(avn)
    with pytest.raises(AttributeError, match="it has Simulator"):
        _ = avn.nothing
    assert avn.metrics.spl([1], [4.0], [2.0]) == [0.5]


def test_a_scene_is_that_of_the_commands(scene, outputs):
    names = avn.scene_names(["split=mini"])
    assert scene.name == names[0]
    assert scene.folder.parent == outputs / "generate"
    other = avn.load_scene(names[-1], [*ACOUSTICS, f"outputs={outputs}"])
    assert other.name == names[-1]
    with pytest.raises(avn.UserError, match=f"no apartment 'room_9'; there are {names[0]}"):
        avn.load_scene("room_9", ["split=mini"])


def test_the_ear_towards_the_source_hears_more(scene):
    """One metre from a source in sight, with the source at the side."""
    differences = {"left": [], "right": []}
    for source, cell, ahead in _beside(scene):
        for turn, side in ((1, "left"), (3, "right")):  # turned clockwise, it is on the left
            state = 4 * cell + (ahead + turn) % 4
            clip = avn.render_clip(scene, source, state, "clock", overrides=["sound=[alarm,clock]"])
            assert clip.shape == (2, 16000)
            left, right = 10 * np.log10(np.mean(clip**2, axis=1))
            differences[side].append(left - right)
    assert np.mean(differences["left"]) > 1
    assert np.mean(differences["right"]) < -1


def _beside(scene):
    """Each source with a cell two steps away along an axis, and the heading towards it."""
    for source, at in enumerate(scene.sources):
        off = scene.grid.lattice[at] - scene.grid.lattice
        near = (np.abs(off).min(1) == 0) & (np.abs(off).max(1) == 2) & scene.in_sight[source]
        for cell in np.flatnonzero(near):
            east, north = off[cell]
            yield source, int(cell), int(np.argmax([north, east, -north, -east]))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"source": 99, "state": 0}, "source: 99 is none of 0 to"),
        ({"source": 0, "state": -1}, "state: -1 is none of 0 to"),
        ({"source": 0, "state": 0, "sound": "dog"}, "sound: 'dog' is none of"),
        ({"source": 0, "state": 0, "overrides": ["sound=nowhere.wav"]}, "nowhere.wav"),
        ({"source": 0, "state": 0, "overrides": ["mapper.size=51"]}, "mapper.size: not read"),
        ({"source": 0, "state": 0, "overrides": "sound=alarm"}, "give a list"),
    ],
)
def test_mistakes_get_a_line(scene, arguments, said):
    with pytest.raises(avn.UserError, match=said):
        avn.render_clip(scene, **arguments)


def test_views_are_one_for_each_state(scene, outputs):
    views = avn.load_views(overrides=[*VIEWS, f"outputs={outputs}"])
    assert views.shape == (4 * scene.grid.cells, 32, 32, 3)
    assert views.dtype == np.uint8
    assert views.std() > 5


class Wanderer(Agent):
    """Forward, and to the left after a collision."""

    def act(self, observation):
        return torch.where(observation["collided"], ROTATE_LEFT, FORWARD)


def test_an_agent_of_ones_own_and_a_row_walk_the_same_episodes(outputs):
    shared = [*EPISODES, f"outputs={outputs}"]
    mine, theirs = avn.evaluate(Wanderer(), shared), avn.evaluate("random_walk", shared)
    keys = ["scene", "sound", "episode", "start_cell", "start_heading", "source"]
    assert mine[keys].equals(theirs[keys].astype(mine[keys].dtypes))
    assert list(mine.columns) == list(theirs.columns)
    assert set(mine["agent"]) == {"Wanderer"}
    assert mine.equals(avn.evaluate(Wanderer(), shared))
    assert {"sr", "spl"} <= set(avn.summarise(mine).columns)
    with pytest.raises(avn.UserError, match=r"acoustics\.rays: not read"):
        avn.evaluate(Wanderer(), [*shared, "acoustics.rays=77"])


def test_a_simulator_steps_all_episodes_at_once(outputs):
    simulator = avn.make_simulator(overrides=[*EPISODES, f"outputs={outputs}"])
    observation = simulator.reset()
    while not simulator.done.all():
        observation = simulator.step(Wanderer().act(observation))
    records = avn.evaluate(Wanderer(), [*EPISODES, f"outputs={outputs}"])
    first = records[records["scene"] == simulator.scene.name]
    assert first["success"].astype(bool).tolist() == simulator.success.tolist()
    with pytest.raises(avn.UserError, match="observation 'smell'"):
        avn.make_simulator(observations=["smell"], overrides=EPISODES)
