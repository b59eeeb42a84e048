"""Worlds of the environments for other libraries: apartments, observations and episodes."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from omegaconf import DictConfig

from avn.agents.external import External
from avn.apartments.splits import PARTS
from avn.config.python import compose_command, composing
from avn.config.unread import refuse_unread
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.settings import leaves
from avn.dataset.scene import Scene
from avn.dataset.views import Views
from avn.mapping.ego_map import WIDTH
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.episodes import EXHAUSTIVE
from avn.navigation.frozen_batch import FrozenBatch
from avn.navigation.protocols import Protocol
from avn.navigation.scene_batch import SceneBatch, build_scene_batch
from avn.navigation.start_sampler import build_start_sampler
from avn.pipeline.agent import build_agent
from avn.pipeline.apartments import TEST, TRAINING, Apartments
from avn.pipeline.audio_inference import SELECTION_CLIPS, TRAINING_CLIPS, Clips
from avn.pipeline.building import build
from avn.pipeline.observation_table import OBSERVATIONS, OWN
from avn.pipeline.observations import Observed
from avn.pipeline.policy import learns
from avn.pipeline.policy_data import build_algorithm
from avn.pipeline.run import episodes_of
from avn.pipeline.scenes import Geometry
from avn.pipeline.sounds import sound_files
from avn.pipeline.stage import MACHINE, Stage
from avn.pipeline.views import RenderedViews
from avn.rl.environment import NavigationEnv

NAMES = (*OBSERVATIONS, *OWN, "map")
# Value of `max_steps` that stands for `algorithm.max_steps`.
OF_ALGORITHM = "algorithm"
MaxSteps = int | str | None


@dataclass(frozen=True)
class World:
    """Apartments of a part of a split, with the observations of an agent in them.

    Attributes
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    part : {"train", "validation", "test"}
        Part of the split.
    observations : tuple of str
        Names of the observations.
    scenes : list of Scene
        Apartments.
    tables : SceneBatch
        Apartments and observations as tables.
    protocol : Protocol
        Actions, goal and limits of the episodes.
    sounds : list of str
        Names of the sounds.
    views : list of Views or None
        Views of each apartment, for pictures.
    """

    cfg: DictConfig
    part: str
    observations: tuple[str, ...]
    scenes: list[Scene]
    tables: SceneBatch
    protocol: Protocol
    sounds: list[str]
    views: list[Views] | None

    def environment(self, n: int, max_steps: MaxSteps = OF_ALGORITHM) -> NavigationEnv:
        """Make an environment of N episodes.

        Its episodes differ from those of any other, unless it is seeded.

        Parameters
        ----------
        n : int
            N, number of agents.
        max_steps : int, "algorithm" or None
            Actions after which an episode is truncated: a number, `algorithm.max_steps`, or None
            for the limits of the protocol alone, which the episodes of `test` always have.
        """
        recipe, seed = build_algorithm(self.cfg), secrets.randbits(62)
        episodes: BatchedEpisodes
        if self.part == "test":
            lists = [episodes_of(self.cfg, scene, self.protocol) for scene in self.scenes]
            episodes = FrozenBatch(self.tables, lists, n, self.protocol, recipe.reward)
        else:
            most = recipe.max_steps if isinstance(max_steps, str) else max_steps
            starts = build_start_sampler(self.tables)
            episodes = BatchedEpisodes(
                self.tables, starts, n, self.protocol, most, recipe.reward, seed
            )
        env = NavigationEnv(
            episodes,
            self.observations,
            map_size=self.cfg.mapper.size,
            map_width=self.cfg.baseline.get("map_width", WIDTH),
        )
        episodes.seed(seed)  # a list of episodes begins with the first reset
        return env


def open_world(
    overrides: Sequence[str],
    part: str,
    observations: Sequence[str] | None,
    max_steps: MaxSteps = OF_ALGORITHM,
    pictures: bool = False,
) -> World:
    """Compose a config, build what is missing, and load the apartments.

    Parameters
    ----------
    overrides : sequence of str
        Settings of `avn.eval agent=external`, such as `split=mini`. `model=NAME`, as in
        `avn.train`, is the same as `agent=NAME`.
    part : {"train", "validation", "test"}
        Part of the split. The first two are those of the training world.
    observations : sequence of str, optional
        Names of the observations; those of the row's agent by default.
    max_steps : int, "algorithm" or None
        See `World.environment`.
    pictures : bool
        Whether views are loaded for pictures.

    Raises
    ------
    UserError
        If a setting is not valid, or is not read.
    """
    if part not in PARTS:
        raise UserError(f"part: '{part}' is none of {', '.join(PARTS)}")
    if isinstance(observations, str):
        raise UserError(f"observations: '{observations}' is one string; give a list of names")
    if isinstance(overrides, str):
        raise UserError(f"overrides: '{overrides}' is one string; give a list, ['{overrides}']")
    check_max_steps(max_steps, part)
    names = None if observations is None else tuple(map(str, observations))
    return _opened(tuple(map(str, overrides)), part, names, max_steps, pictures)


@lru_cache(maxsize=4)
def _opened(
    overrides: tuple[str, ...],
    part: str,
    names: tuple[str, ...] | None,
    max_steps: MaxSteps,
    pictures: bool,
) -> World:
    # environments of one process share their tables
    cfg, given = compose_command("eval", _of_eval(overrides))
    observations = _of_agent(cfg) if names is None else names
    observed = _observed(cfg, part, observations)
    geometry = Geometry(cfg, observed.apartments)
    rendered = RenderedViews(cfg, observed.apartments)
    # both parts of the training world accept the same settings
    alike = ("test",) if part == "test" else ("train", "validation")
    read = {"baseline.observations"} if names is None else set()
    for own in alike:
        read |= _read(cfg, own, observations, max_steps, pictures)
    with composing():
        refuse_unread("eval", cfg, read, given)
    for stage in _stages(cfg, part, observations, pictures):
        build(stage)
    scenes, protocol = geometry.load(), build_object("protocol", cfg.protocol)
    sounds = list(sound_files(cfg, observed.apartments.world))
    tables = build_scene_batch(scenes, protocol, observed.load(scenes), len(sounds))
    views = rendered.load() if pictures else None
    return World(cfg, part, observations, scenes, tables, protocol, sounds, views)


def _of_eval(overrides: Sequence[str]) -> list[str]:
    """Return overrides with a row, `agent=external` unless one is named, also as `model=`."""
    found = [
        f"agent={own.removeprefix('model=')}" if own.startswith("model=") else own
        for own in overrides
    ]
    return found if any(own.startswith("agent=") for own in found) else ["agent=external", *found]


def _of_agent(cfg: DictConfig) -> tuple[str, ...]:
    """Return the observations of the config's agent."""
    agent = build_agent(cfg)
    if isinstance(agent, External):
        return agent.observations
    names = agent.wants(build_object("protocol", cfg.protocol))
    return tuple("map" if learns(cfg) and name == "local_patch" else name for name in names)


def _observed(cfg: DictConfig, part: str, names: Sequence[str]) -> Observed:
    """Return the observations in the apartments of a part; raise `UserError` for unknown ones."""
    if not names:
        raise UserError(f"observations: there are none; name some of {', '.join(NAMES)}")
    for name in names:
        if name not in NAMES:
            raise UserError(f"observations: '{name}' is none of {', '.join(NAMES)}")
    needed = [name for name in names if name != "map"]
    needed += ["local_patch"] if "map" in names else []
    clips = {"train": TRAINING_CLIPS, "validation": SELECTION_CLIPS}.get(part, Clips())
    apartments = Apartments(cfg, part, TEST if part == "test" else TRAINING)
    observed = Observed(apartments, needed, clips)
    observed.check(str(cfg.agent.name), needed)
    return observed


def _stages(cfg: DictConfig, part: str, names: Sequence[str], pictures: bool) -> list[Stage]:
    """Return the stages of the apartments, the observations and the pictures of a part."""
    observed = _observed(cfg, part, names)
    rendered = [RenderedViews(cfg, observed.apartments)] if pictures else []
    return [Geometry(cfg, observed.apartments), *observed.stages.values(), *rendered]


def _read(
    cfg: DictConfig, part: str, names: Sequence[str], max_steps: MaxSteps, pictures: bool
) -> set[str]:
    """Return the leaf keys that the environment of a part reads."""
    stages = _stages(cfg, part, names, pictures)
    own = _own_keys(cfg, part, names, max_steps)
    return leaves(cfg, own, _unread_keys(cfg, part, max_steps)).union(
        *(stage.read() for stage in stages)
    )


def _own_keys(
    cfg: DictConfig, part: str, names: Sequence[str], max_steps: MaxSteps
) -> tuple[str, ...]:
    """Return the keys that the environment reads itself."""
    keys = [*MACHINE, "protocol", "algorithm.reward", *_observed(cfg, part, names).settings]
    if "map" in names:
        keys += ["mapper.size", "baseline.map_width"]
    if part == "test":
        explores = cfg.episodes != EXHAUSTIVE and cfg.protocol.exploration_steps > 0
        return (*keys, "seed", "episodes", "sound", *(["exploration"] if explores else []))
    limit = ["algorithm.max_steps"] if max_steps == OF_ALGORITHM else []
    return (*keys, "training.sounds", *limit)


def _unread_keys(cfg: DictConfig, part: str, max_steps: MaxSteps) -> tuple[str, ...]:
    """Return the keys of the protocol that the environment does not read."""
    unread = ["protocol.name"]
    if cfg.protocol.goal != "radius":
        unread.append("protocol.radius")
    if part != "test" or cfg.episodes == EXHAUSTIVE:
        unread += ["protocol.num_starts", "protocol.exploration_steps"]
    limited = part == "test" or max_steps is None
    if not limited:
        unread += ["protocol.max_actions", "protocol.max_moves_ratio"]
    if not limited or cfg.protocol.max_moves_ratio is None:
        unread.append("protocol.cap")
    return tuple(unread)


def check_max_steps(max_steps: Any, part: str) -> None:
    """Raise `UserError` for a number of steps that cannot be."""
    if max_steps is None or max_steps == OF_ALGORITHM:
        return
    if isinstance(max_steps, bool) or not isinstance(max_steps, int) or max_steps < 1:
        raise UserError(f"max_steps: {max_steps!r}; give 1 or more, '{OF_ALGORITHM}' or None")
    if part == "test":
        raise UserError(
            f"max_steps: {max_steps}; the episodes of part='test' end as in avn.eval, by "
            "protocol.max_actions and protocol.max_moves_ratio"
        )
