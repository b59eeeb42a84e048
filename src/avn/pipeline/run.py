"""Stage of a run: evaluation of an agent over all episodes of the test apartments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from omegaconf import DictConfig, OmegaConf

from avn.acoustics.sound_names import joined_names
from avn.agents.rollout import Labels, Watch, rollout_scene
from avn.apartments.splits import PARTS
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.files import atomic_write, check_name
from avn.core.progress import progress_bar
from avn.dataset.scene import Scene
from avn.navigation.episodes import (
    EXHAUSTIVE,
    LISTS,
    ONE_SOUND,
    Episodes,
    exhaustive_episodes,
    frozen_episodes,
)
from avn.navigation.exploration import EXPLORATIONS
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator
from avn.pipeline import perception_tables
from avn.pipeline.agent import (
    agent_content,
    agent_ignored,
    agent_settings,
    agent_stages,
    build_agent,
    check_agent,
)
from avn.pipeline.apartments import Apartments
from avn.pipeline.dynamics import build_dynamics, changing, check_dynamics
from avn.pipeline.observations import Observed
from avn.pipeline.occupancy import OccupancyNetwork
from avn.pipeline.policy import learns
from avn.pipeline.recordings import keep_recordings
from avn.pipeline.scenes import Geometry
from avn.pipeline.sounds import check_heard, sound_files, sounds_content
from avn.pipeline.stage import Stage
from avn.reporting import results
from avn.reporting.finished_run import EPISODE_RECORDS, RESULTS


def wanted_by(cfg: DictConfig) -> tuple[str, ...]:
    """Return the observations that the agent of a config needs."""
    return build_agent(cfg).wants(build_object("protocol", cfg.protocol))


def agent_label(cfg: DictConfig) -> str:
    """Return the name of the config's agent in tables, with its `oracle_inputs`."""
    return "-true-".join((cfg.agent.name, *cfg.agent.oracle_inputs))


class Evaluation(Stage):
    """Stage of a run: records of an agent over all episodes of a subset of the test world.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    name : str, optional
        Name of the run in messages; that of the agent by default.
    """

    kind = "eval"
    # Raised when the code of simulator, agents or metrics changes a record.
    version = 5

    def __init__(self, cfg: DictConfig, name: str | None = None) -> None:
        super().__init__(cfg)
        self._name = name or cfg.agent.name

    @property
    def apartments(self) -> Apartments:
        """Apartments of the episodes."""
        return Apartments(self.cfg, self.cfg.subset)

    @property
    def geometry(self) -> Geometry:
        """Stage of the apartments' geometry."""
        return Geometry(self.cfg, self.apartments)

    @property
    def observed(self) -> Observed:
        """Observations of the agent."""
        return Observed(self.apartments, wanted_by(self.cfg), truth=self.cfg.agent.oracle_inputs)

    def needs(self) -> Sequence[Stage]:
        """Return the stages of geometry, observations and the agent's networks."""
        stages = self.observed.stages
        # for the prior in the table of local patches
        prior = [OccupancyNetwork(self.cfg)] if "local_patch" in stages else []
        return (self.geometry, *stages.values(), *agent_stages(self.cfg), *prior)

    def settings(self) -> Sequence[str]:
        """Return the keys of the protocol, the episodes and the agent."""
        explores = ("exploration",) if self._walks_first else ()
        return (
            "protocol",
            "agent",
            "seed",
            "episodes",
            *explores,
            # a column of the records, also for agents without a microphone
            "acoustics.name",
            *agent_settings(self.cfg),
            *self.observed.settings,
            *changing(self.cfg),
        )

    def ignored(self) -> Sequence[str]:
        """Return the keys that do not change this agent's records under this protocol."""
        radius = () if self.cfg.protocol.goal == "radius" else ("protocol.radius",)
        frozen = self.cfg.episodes != EXHAUSTIVE
        lists = () if frozen else ("protocol.num_starts", "protocol.exploration_steps")
        cap = ("protocol.cap",) if self.cfg.protocol.max_moves_ratio is None else ()
        return (*agent_ignored(self.cfg), *radius, *lists, *cap)

    @property
    def _walks_first(self) -> bool:
        return self.cfg.episodes != EXHAUSTIVE and self.cfg.protocol.exploration_steps > 0

    def consulted(self) -> Sequence[str]:
        """Return the keys of the subset, of the sounds and of films of a finished run."""
        return ("subset", "sound", "film", "film_show", "film_speed")

    def content(self) -> Any:
        """Return the hashes of the recordings, and of the policy of an external agent."""
        return [*sounds_content(self.cfg), *agent_content(self.cfg)]

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        cfg = self.cfg
        return f"run of '{self._name}' (seed {cfg.seed}, train_seed {cfg.train_seed})"

    @property
    def folder(self) -> Path:
        """`outputs/eval/<agent>/<sounds>/seed<seed>-<hash8>`."""
        sounds = joined_names(sound_files(self.cfg), "-")
        check_name("agent.name", self.cfg.agent.name)
        name = f"seed{self.cfg.seed}-{self.fingerprint[:8]}"
        return Path(self.cfg.outputs) / "eval" / self.cfg.agent.name / sounds / name

    def seconds(self) -> float:
        """Estimate 40 ms an episode with a posterior, 5 ms with a map or a network, 0.5 ms else."""
        plans, sounds = self.apartments.plans, len(sound_files(self.cfg))
        sounds = 1 if self.cfg.episodes == ONE_SOUND else sounds
        episodes = self.cfg.protocol.num_starts * sounds * sum(len(own.sources) for own in plans)
        if self.cfg.episodes == EXHAUSTIVE:
            episodes = 4 * self.apartments.pairs * sounds
        if "arrival" in wanted_by(self.cfg):
            return episodes * 0.04
        return episodes * (0.005 if self.cfg.planner._target_ or learns(self.cfg) else 0.0005)

    @property
    def timed_as(self) -> str:
        """Agents differ in their duration."""
        return f"{self.kind}/{self.cfg.agent.name}"

    def check(self) -> None:
        """Refuse options that cannot work, before anything is made."""
        cfg = self.cfg
        if not 0 <= cfg.seed < 2**62:
            raise UserError(f"seed: {cfg.seed} is out of range; give 0 or more")
        for key, known in (
            ("episodes", LISTS),
            ("subset", PARTS),
            ("exploration", EXPLORATIONS),
        ):
            if cfg[key] not in known:
                raise UserError(f"{key}: '{cfg[key]}' is none of {', '.join(known)}")
        build_object("protocol", cfg.protocol)  # refuses contradictory rules first
        agent = build_agent(cfg)
        if agent.privileged != cfg.agent.privileged:
            raise UserError(
                f"agent.privileged: {cfg.agent.privileged}, but '{type(agent).__name__}' is "
                f"{'' if agent.privileged else 'not '}shown the truth; say so in the row"
            )
        self.observed.check(
            type(agent).__name__, agent.wants(build_object("protocol", cfg.protocol))
        )
        if agent.explores and not self._walks_first:
            raise UserError(
                f"episodes: agent {type(agent).__name__} explores first, and these episodes have "
                "no exploration walk; take episodes=frozen and protocol.exploration_steps=400"
            )
        check_agent(cfg, agent)
        check_dynamics(cfg, self.apartments.plans)
        check_heard(cfg)  # a bad file is refused before anything is made

    def done(self) -> bool:
        """Return whether the results have been written."""
        return (self.folder / RESULTS).is_file()

    def make(self) -> None:
        """Run the episodes and write `episodes.csv`, `results.csv` and TensorBoard events."""
        from avn.pipeline.run_events import write_events

        cfg, folder, scenes = self.cfg, self.folder, self.geometry.load()
        observations = self.observed.load(scenes)
        episodes = pd.concat(rollout_scenes(cfg, scenes, observations), ignore_index=True)
        protocol: Protocol = build_object("protocol", cfg.protocol)
        walks = [episodes_of(cfg, scene, protocol).trajectories for scene in scenes]
        perception_tables.write(self.observed, scenes, walks, observations, folder)
        summary = results.summarise(episodes)
        write_events(cfg, folder, episodes, summary, self.read())
        with atomic_write(folder / "config.yaml") as part:
            OmegaConf.save(cfg, part, resolve=True)
        keep_recordings(cfg, folder)
        results.write_csv(episodes, folder / EPISODE_RECORDS)
        results.write_csv(summary, folder / RESULTS)


def rollout_scenes(
    cfg: DictConfig,
    scenes: Sequence[Scene],
    observations: Sequence[SceneObservations],
    watch: Watch | None = None,
) -> list[pd.DataFrame]:
    """Run the agent of a config in all episodes of some scenes.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    scenes : sequence of Scene
        Scenes of the episodes.
    observations : sequence of SceneObservations
        Observations in each scene.
    watch : callable, optional
        Callback of every step; see `avn.agents.rollout.Watch`.

    Returns
    -------
    list of DataFrame
        Records of each scene.
    """
    protocol: Protocol = build_object("protocol", cfg.protocol)
    agent, dynamics = build_agent(cfg, ready=True), build_dynamics(cfg)
    labels = Labels(
        agent=agent_label(cfg),
        acoustics=cfg.acoustics.name,
        look=cfg.look if cfg.planner._target_ else "once",
    )
    episodes = [episodes_of(cfg, scene, protocol) for scene in scenes]
    total = sum(len(own.start) for own in episodes)
    with progress_bar(f"walking of '{labels.agent}'", total, "episodes") as advance:
        return [
            rollout_scene(
                *(agent, scene, own, protocol, labels, observed),
                watch=watch or _counting(advance),
                dynamics=dynamics,
            )
            for scene, own, observed in zip(scenes, episodes, observations, strict=True)
        ]


def _counting(advance: Callable[[int], None]) -> Watch:
    """Return a callback that counts the episodes of a scene that have ended."""
    counted = 0

    def watch(simulator: Simulator, *_: Any) -> bool:
        nonlocal counted
        ended = int(simulator.done.sum())
        advance(ended - counted)
        counted = ended
        return False

    return watch


def episodes_of(cfg: DictConfig, scene: Scene, protocol: Protocol) -> Episodes:
    """Return the episodes of a scene.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    scene : Scene
        Scene of the episodes.
    protocol : Protocol
        Protocol of the config.
    """
    sounds = list(sound_files(cfg))
    if cfg.episodes == EXHAUSTIVE:
        return exhaustive_episodes(scene, sounds, protocol, cfg.seed)
    one_sound = cfg.episodes == ONE_SOUND
    return frozen_episodes(scene, sounds, protocol, cfg.seed, cfg.exploration, one_sound)
