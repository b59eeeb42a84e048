"""Stage of actor-critic agents: their networks, trained by reinforcement learning."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd
import torch
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.agents.actor_critic import ActorCriticAgent
from avn.agents.rollout import Labels, rollout_scene
from avn.core.classes import build_object, import_class
from avn.core.errors import UserError
from avn.core.files import check_name
from avn.core.progress import log
from avn.core.settings import plain
from avn.dataset.scene import Scene
from avn.mapping.ego_map import EgoMap
from avn.navigation.episodes import frozen_episodes
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.scene_batch import SceneBatch
from avn.pipeline.apartments import TRAINING
from avn.pipeline.occupancy import has_occupancy_model
from avn.pipeline.policy_data import (
    SUBSETS,
    actor_critic,
    check_observations,
    feature_sizes,
    load_subset,
    observation_names,
    observed,
    subset_stages,
    tables_of,
)
from avn.pipeline.sound_network import has_sound_model
from avn.pipeline.sounds import sound_files
from avn.pipeline.trained import METRICS, Trained

if TYPE_CHECKING:
    from avn.rl.algorithm import Algorithm
    from avn.rl.networks import ActorCritic, NetworkSpec

# Seed of the episodes on which an agent is evaluated during training.
MEASURED_SEED = 0
# Maximum number of rows from which mean and standard deviation of a feature are estimated.
_EXAMPLES = 200_000


def learns(cfg: DictConfig) -> bool:
    """Return whether the config's agent is an actor-critic."""
    target = cfg.baseline._target_
    return bool(target) and issubclass(import_class("baseline._target_", target), ActorCriticAgent)


def build_algorithm(cfg: DictConfig) -> Algorithm:
    """Build the algorithm of a config; raise `UserError` where there is none, or it cannot work."""
    if not cfg.algorithm._target_:
        raise UserError("algorithm: 'none' trains nothing; choose a3c")
    algorithm: Algorithm = build_object("algorithm", cfg.algorithm)
    return algorithm


class Policy(Trained):
    """Stage of the network of an actor-critic agent."""

    kind = "train/policy"
    version = 2

    @property
    def name(self) -> str:
        """Name of the row, which names the folder."""
        return str(self.cfg.agent.name)

    @property
    def seed(self) -> int:
        """Seed of the training."""
        return int(self.cfg.algorithm.train_seed)

    @property
    def monitor(self) -> str:
        """Metric by which the best round is chosen."""
        from avn.rl.training import MONITOR

        return MONITOR

    def check(self) -> None:
        """Refuse an agent that does not learn, and recipes that cannot work."""
        if not learns(self.cfg):
            raise UserError(
                f"baseline: that of agent '{self.cfg.agent.name}' is no actor-critic; choose "
                "model=a3c_va"
            )
        check_name("agent.name", self.cfg.agent.name)
        build_algorithm(self.cfg)
        check_observations(self.cfg)
        if self.cfg.baseline.memory and not self.cfg.protocol.exploration_steps:
            raise UserError(
                "protocol.exploration_steps: 0, and an agent with memory explores; give 400"
            )
        if has_occupancy_model(self.cfg):
            EgoMap(1, self.cfg.mapper.size, self.cfg.baseline.map_width)

    def needs(self) -> Sequence[Any]:
        """Return the stages of scenes and observations of training and validation apartments."""
        return [stage for subset in SUBSETS for stage in subset_stages(self.cfg, subset)]

    def settings(self) -> Sequence[str]:
        """Return the keys of the network's shape, the algorithm and the protocol."""
        maps = ("mapper.size",) if has_occupancy_model(self.cfg) else ()
        observation_keys = observed(self.cfg, "train").settings
        # the name is part of the folder, so that two rows never share one
        return ("agent.name", "baseline", "algorithm", "protocol", *maps, *observation_keys)

    def ignored(self) -> Sequence[str]:
        """Return keys of evaluation only, and keys of parts that the agent does not have."""
        memory, maps = self.cfg.baseline.memory, has_occupancy_model(self.cfg)
        radius = self.cfg.protocol.goal != "radius"
        return [
            "baseline.samples",
            # of evaluations, and a label
            "protocol.num_starts",
            "protocol.name",
            *(
                ()
                if memory
                else ("algorithm.exploration_walks", "algorithm.memory_refresh_interval")
            ),
            *(() if maps else ("baseline.map_width",)),
            *(() if memory and maps else ("baseline.top",)),
            *(("protocol.radius",) if radius else ()),
            *(() if has_sound_model(self.cfg) else ("algorithm.realisations",)),
        ]

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        acoustics, seed = self.train.node("acoustics").name, self.cfg.algorithm.train_seed
        settings = f"{acoustics}, {self.cfg.protocol.name}, train_seed {seed}"
        return f"agent '{self.cfg.agent.name}' ({settings})"

    def seconds(self) -> float:
        """Estimate the duration from the number of actions and the cost of each."""
        recipe, parts = self.cfg.algorithm, 1 + has_occupancy_model(self.cfg)
        parts += bool(self.cfg.baseline.memory)
        microseconds = 48 * parts / min(2, max(1, recipe.workers))
        return float(recipe.total_steps * microseconds / 1e6)

    def make(self) -> None:
        """Train the network, or resume an interrupted training."""
        _train(self)

    def load(self) -> ActorCritic:
        """Return the trained network, set to evaluation.

        Raises
        ------
        UserError
            Where a checkpoint belongs to another config, or has changed since it was trained.
        """
        from avn.rl.networks import ActorCritic
        from avn.rl.training import BEST, load_network

        network = ActorCritic(_network_spec(self.cfg, self._feature_sizes()))
        load_network(network, self.folder / BEST, self.fingerprint)
        self.check_weights()
        return network.eval()

    def _feature_sizes(self) -> dict[str, int]:
        sizes = self.metrics().get("features")
        if not isinstance(sizes, dict):
            raise UserError(
                f"{self.folder / METRICS}: damaged; delete {self.folder} to train again"
            )
        # the sum over features is one of floating-point numbers: their order is that of training
        order = [name for name in observation_names(self.cfg) if name in sizes]
        return {name: int(sizes[name]) for name in order}


def _network_spec(cfg: DictConfig, features: dict[str, int]) -> NetworkSpec:
    from avn.rl.networks import NetworkSpec

    protocol: Protocol = build_object("protocol", cfg.protocol)
    return NetworkSpec(
        features=features,
        actions=protocol.actions,
        width=cfg.baseline.width,
        memory=cfg.baseline.memory,
        map_channels=has_occupancy_model(cfg) * (2 if cfg.baseline.memory else 1),
        map_width=cfg.baseline.map_width,
    )


def _train(policy: Policy) -> None:
    """Train a policy and write its metrics."""
    from avn.rl.networks import ActorCritic
    from avn.rl.training import MONITOR, Training, best_of
    from avn.rl.worker import TrainingSpec

    started = time.perf_counter()
    cfg, recipe = policy.cfg, build_algorithm(policy.cfg)
    opened = {subset: load_subset(cfg, subset) for subset in SUBSETS}
    tables = tables_of(cfg, opened["train"])
    features = feature_sizes(cfg, tables)
    network_spec = _network_spec(cfg, features)
    torch.manual_seed(recipe.train_seed)
    network = ActorCritic(network_spec)
    for name in features:
        table = tables.visual.get(name, tables.audio.get(name))
        assert table is not None
        network.standardise(name, table[:: max(1, len(table) // _EXAMPLES)])
    protocol: Protocol = build_object("protocol", cfg.protocol)
    spec = TrainingSpec(
        tables=tables,
        protocol=protocol,
        network_spec=network_spec,
        recipe=recipe,
        buffers=dict(network.named_buffers()),
        map_size=cfg.mapper.size,
        trajectories=_trajectories(cfg, opened["train"][0], tables),
        top=cfg.baseline.top,
    )
    measure = Measure(cfg, opened, protocol)
    curve = Training(
        spec, network, policy.folder, measure, policy.fingerprint, policy.run_name
    ).run()
    best = best_of(curve)
    if best[MONITOR] <= curve[0][MONITOR]:
        log(
            f"warning: {policy.folder}: no network was better on validation than the untrained one "
            f"({MONITOR} {curve[0][MONITOR]:.3f}); the one after {best['steps']:.0f} steps is kept "
            f"({best[MONITOR]:.3f}); give more algorithm.total_steps, more "
            "algorithm.validation_starts, or a split with more validation apartments"
        )
    metrics: dict[str, Any] = {f"best/{name}": value for name, value in best.items()}
    metrics |= {f"untrained/{name}": value for name, value in curve[0].items()}
    metrics |= {"features": features, "steps": curve[-1]["steps"]}
    metrics |= {"seconds": time.perf_counter() - started}
    policy.finish(
        metrics, {name: plain(cfg, name) for name in ("baseline", "algorithm", "protocol")}
    )


def _trajectories(cfg: DictConfig, scenes: Sequence[Scene], tables: SceneBatch) -> Tensor | None:
    from avn.rl.exploration_memory import draw_trajectories

    if not cfg.baseline.memory:
        return None
    steps = cfg.protocol.exploration_steps
    return draw_trajectories(
        [*scenes], tables, cfg.algorithm.exploration_walks, steps, cfg.algorithm.train_seed
    )


def _returns(records: pd.DataFrame, reward: RewardConfig) -> pd.Series:
    """Return each episode's undiscounted return under the training reward."""
    success, collisions = records["success"], records["collisions"]
    others = records["actions"] - success - collisions
    return success * reward.success + collisions * reward.collision + others * reward.step


class Measure:
    """Evaluation of a network on training and validation apartments, under the protocol.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    observed : dict of str to tuple
        Scenes and their observations by subset, as `load_subset` gives them.
    protocol : Protocol
        Protocol of the episodes.
    """

    def __init__(self, cfg: DictConfig, observed: dict[str, Any], protocol: Protocol) -> None:
        self._cfg, self._observed = cfg, observed
        self._protocol = dataclasses.replace(protocol, num_starts=cfg.algorithm.validation_starts)
        acoustics = OmegaConf.select(cfg, TRAINING.acoustics).name
        self._labels = Labels(agent=cfg.agent.name, acoustics=acoustics)

    def __call__(self, network: ActorCritic) -> dict[str, float]:
        """Evaluate a network: mean return, success rate and SPL, such as `validation/spl`."""
        metrics = {}
        agent = actor_critic(self._cfg, network)
        agent.samples = True  # the best network does not depend on how it acts later
        for subset, (scenes, observations) in self._observed.items():
            records = pd.concat(
                rollout_scene(
                    agent, scene, self._episodes(scene), self._protocol, self._labels, observed
                )
                for scene, observed in zip(scenes, observations, strict=True)
            )
            metrics[f"{subset}/return"] = float(
                _returns(records, self._cfg.algorithm.reward).mean()
            )
            metrics[f"{subset}/success"] = float(records["success"].mean())
            metrics[f"{subset}/spl"] = float(records["spl"].mean())
        return metrics

    def _episodes(self, scene: Scene) -> Any:
        sounds = list(sound_files(self._cfg, TRAINING))
        return frozen_episodes(scene, sounds, self._protocol, MEASURED_SEED)
