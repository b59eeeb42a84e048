"""Functions of the package for scripts and notebooks; `import avn` offers them by name.

Each takes the overrides of a command, such as ``["split=mini", "acoustics=diffraction"]``. What is
missing is built, and kept in the folder `outputs` as by the commands.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from omegaconf import DictConfig

from avn.acoustics.clips import ClipRenderer, brir_spectra
from avn.agents.base import Agent
from avn.agents.rollout import Labels, rollout_scene
from avn.config.python import compose_command, composing
from avn.config.unread import refuse_unread
from avn.core.classes import build_object
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.settings import leaves
from avn.dataset.scene import AudibleScene, Scene
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator
from avn.pipeline.apartments import Apartments, PerApartment
from avn.pipeline.building import build
from avn.pipeline.dynamics import build_dynamics, changing
from avn.pipeline.export import settings_of
from avn.pipeline.models import model_of, train_model
from avn.pipeline.observations import Observed
from avn.pipeline.run import Evaluation, episodes_of
from avn.pipeline.scenes import DirectSound, Geometry
from avn.pipeline.sounds import dry_sounds, microphone_of
from avn.pipeline.views import RenderedViews
from avn.reporting.finished_run import read_run

# Order in which apartments are listed.
_SUBSETS = ("test", "validation", "train")
_Kind = TypeVar("_Kind", bound=PerApartment)
Overrides = Sequence[str]


def scene_names(overrides: Overrides = ()) -> list[str]:
    """Return the names of all apartments of a split, the test apartments first."""
    cfg, _ = compose_command("eval", overrides)
    return [name for subset in _SUBSETS for name in _names(cfg, subset)]


def load_scene(name: str | None = None, overrides: Overrides = ()) -> AudibleScene:
    """Load an apartment with its grid, sources, lines of sight and impulse responses.

    Parameters
    ----------
    name : str, optional
        Name of the apartment, see `scene_names`; the first test apartment by default.
    overrides : sequence of str
        Settings of `avn.generate`, such as `split=mini` or `acoustics=diffraction`.

    Raises
    ------
    UserError
        If there is no such apartment, or a setting cannot work.
    """
    cfg, given = compose_command("generate", overrides)
    stage, index = _built(cfg, given, name, DirectSound)
    return stage.load()[index]


def load_views(name: str | None = None, overrides: Overrides = ()) -> NDArray[np.uint8]:
    """Load the view of each state of an apartment.

    Parameters
    ----------
    name : str, optional
        Name of the apartment, see `scene_names`; the first test apartment by default.
    overrides : sequence of str
        Settings, such as `renderer.camera.size=64`.

    Returns
    -------
    (S, H, W, 3) uint8
        First-person RGB views; state 4 x cell + heading.
    """
    cfg, given = compose_command("generate", overrides)
    stage, index = _built(cfg, given, name, RenderedViews)
    views: NDArray[np.uint8] = np.asarray(stage.load()[index].rgb)
    return views


def render_clip(
    scene: AudibleScene,
    source: int,
    state: int,
    sound: str | None = None,
    realisation: int = 0,
    seed: int = 0,
    overrides: Overrides = (),
) -> NDArray[np.float32]:
    """Render one second of sound at the two ears of an agent.

    It is the clip of an evaluation: same microphone, random start of the recording and noise.

    Parameters
    ----------
    scene : AudibleScene
        Apartment, see `load_scene`.
    source : int
        Index of the source, 0 to K - 1.
    state : int
        State of the agent, 4 x cell + heading.
    sound : str, optional
        Name of a sound of the config; the first one by default.
    realisation : int
        Number of the random draw.
    seed : int
        Seed of the evaluation.
    overrides : sequence of str
        Settings of sound and microphone, such as `sound=path/to/file.wav`, and those of the scene.

    Returns
    -------
    (2, rate) float32
        Left and right ear.

    Raises
    ------
    UserError
        If there is no such source, state or sound.
    """
    cfg, given = compose_command("generate", overrides)
    with composing():
        heard = leaves(cfg, ["sound", "microphone"])
        refuse_unread("generate", cfg, heard | settings_of(cfg), given)
    sounds = dry_sounds(cfg)
    names = list(sounds.names)
    if sound is not None and sound not in names:
        raise UserError(f"sound: '{sound}' is none of {', '.join(names)}")
    limits = {"source": (source, len(scene.sources)), "state": (state, 4 * scene.grid.cells)}
    for key, (value, count) in limits.items():
        if not 0 <= value < count:
            raise UserError(f"{key}: {value} is none of 0 to {count - 1} of {scene.name}")
    renderer = ClipRenderer(sounds, microphone_of(cfg), seed, "eval")
    index = [source, state, names.index(sound) if sound else 0, realisation]
    clip = ClipId(*(torch.tensor([value]) for value in index))
    spectra = brir_spectra(scene.brirs.gather(clip.source, clip.state), sounds.rate)
    clips: NDArray[np.float32] = renderer.render(spectra, clip)[0].numpy()
    return clips


def train(model: str, overrides: Overrides = ()) -> dict[str, float]:
    """Train a network or an actor-critic agent, or read it where it is trained.

    Parameters
    ----------
    model : str
        Model of `avn.train`, such as "sound_cnn" or "a3c_va".
    overrides : sequence of str
        Settings of `avn.train`, such as `sound_model.epochs=1`.

    Returns
    -------
    dict of str to float
        Metrics by name, as `avn.train` prints them.

    Raises
    ------
    UserError
        If there is no such model, or a setting cannot work.
    """
    cfg, given = compose_command("train", [*overrides, f"model={model}"])
    stage = model_of(cfg)
    with composing():
        refuse_unread("train", cfg, {*stage.read(), "model.name"}, given)
    return train_model(stage)


def make_simulator(
    name: str | None = None, observations: Sequence[str] = (), overrides: Overrides = ()
) -> Simulator:
    """Make a simulator of all episodes of `avn.eval` in one apartment, stepped as a batch.

    Parameters
    ----------
    name : str, optional
        Name of the apartment; the first one of the subset by default.
    observations : sequence of str
        Names of observations in addition to `collided` and `odometry`, such as `view`.
    overrides : sequence of str
        Settings of `avn.eval`, such as `split=mini` or `protocol=var_stop`.

    Raises
    ------
    UserError
        If there is no such apartment or observation, or a setting cannot work.
    """
    cfg, given = compose_command("eval", [*overrides, "agent=random_walk"])
    scenes, seen = _scenes(cfg, given, "make_simulator", observations)
    names = [scene.name for scene in scenes]
    if name is not None and name not in names:
        raise UserError(f"name: there is no apartment '{name}'; there are {', '.join(names)}")
    index = names.index(name) if name else 0
    protocol: Protocol = build_object("protocol", cfg.protocol)
    episodes = episodes_of(cfg, scenes[index], protocol)
    return Simulator(scenes[index], episodes, protocol, seen[index], build_dynamics(cfg))


def evaluate(agent: str | Agent, overrides: Overrides = ()) -> pd.DataFrame:
    """Evaluate an agent in all episodes of `avn.eval`.

    Parameters
    ----------
    agent : str or Agent
        Row of the table, such as "greedy", whose finished run is read if there is one; or an agent
        of your own, which walks here and writes no files.
    overrides : sequence of str
        Settings of `avn.eval`, such as `split=mini` or `protocol=var_stop`. An agent of your own
        gets its observations from the networks that they name, such as `sound_model=cnn5`.

    Returns
    -------
    DataFrame
        One row for each episode, with the columns of `episodes.csv`; `avn.summarise` averages them.

    Raises
    ------
    UserError
        If a setting cannot work, or an observation of the agent is missing.
    """
    if isinstance(agent, str):
        cfg, given = compose_command("eval", [*overrides, f"agent={agent}"])
        run = Evaluation(cfg)
        run.check()
        with composing():
            refuse_unread("eval", cfg, run.read(), given)
        build(run, explicit=True)
        return read_run(run.folder)[1]
    cfg, given = compose_command("eval", [*overrides, "agent=random_walk"])
    return _walk(agent, cfg, given)


def _walk(agent: Agent, cfg: DictConfig, given: Sequence[str]) -> pd.DataFrame:
    """Run an agent that no config describes."""
    protocol: Protocol = build_object("protocol", cfg.protocol)
    name = type(agent).__name__
    scenes, observations = _scenes(cfg, given, name, agent.wants(protocol))
    labels = Labels(agent=name, acoustics=cfg.acoustics.name)
    records = [
        rollout_scene(
            *(agent, scene, episodes_of(cfg, scene, protocol), protocol, labels, seen),
            dynamics=build_dynamics(cfg),
        )
        for scene, seen in zip(scenes, observations, strict=True)
    ]
    return pd.concat(records, ignore_index=True)


def _scenes(
    cfg: DictConfig, given: Sequence[str], agent: str, wanted: Sequence[str]
) -> tuple[list[Scene], list[SceneObservations]]:
    """Build and load the scenes of a config's subset, with some observations."""
    apartments = Apartments(cfg, cfg.subset)
    observed = Observed(apartments, wanted)
    observed.check(agent, wanted)
    geometry, stages = Geometry(cfg, apartments), observed.stages
    keys = ["agent", "protocol", "episodes", "seed", "subset", "sound", "exploration"]
    own = leaves(cfg, [*keys, *changing(cfg)])
    with composing():
        read = own.union(*(stage.read() for stage in (geometry, *stages.values())))
        refuse_unread("eval", cfg, {*read, *observed.settings}, given)
    for stage in (geometry, *stages.values()):
        build(stage)
    scenes = geometry.load()
    return scenes, observed.load(scenes)


def _names(cfg: DictConfig, subset: str) -> list[str]:
    return [plan.name for plan in Apartments(cfg, subset).plans]


def _built(
    cfg: DictConfig, given: Sequence[str], name: str | None, kind: Callable[..., _Kind]
) -> tuple[_Kind, int]:
    """Build a stage of the apartment's subset; return it, and the index of the apartment."""
    names = {subset: _names(cfg, subset) for subset in _SUBSETS}
    every = [each for found in names.values() for each in found]
    name = every[0] if name is None else name
    for subset, found in names.items():
        if name in found:
            stage = kind(cfg, Apartments(cfg, subset))
            with composing():
                refuse_unread("generate", cfg, stage.read(), given)
            build(stage)
            return stage, found.index(name)
    raise UserError(f"name: there is no apartment '{name}'; there are {', '.join(every)}")
