"""Stage of actor-critic agents: their networks, trained by reinforcement learning."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from omegaconf import DictConfig

from avn.agents.actor_critic import ActorCriticAgent
from avn.core.classes import import_class
from avn.core.errors import UserError
from avn.core.files import check_name
from avn.core.numerics import PORTABLE
from avn.core.progress import log
from avn.core.settings import plain
from avn.mapping.ego_map import EgoMap
from avn.navigation.protocols import GOAL_MEANINGS, Protocol
from avn.pipeline.occupancy import has_occupancy_model
from avn.pipeline.policy_data import (
    SUBSETS,
    build_algorithm,
    check_observations,
    network_spec,
    observation_names,
    observed,
    subset_stages,
)
from avn.pipeline.sound_network import has_sound_model
from avn.pipeline.trained import METRICS, Trained
from avn.rl.curve import MONITOR, best_of

if TYPE_CHECKING:
    from lightning.pytorch.loggers import Logger

    from avn.rl.algorithm import Algorithm
    from avn.rl.networks import ActorCritic


def learns(cfg: DictConfig) -> bool:
    """Return whether the config's agent is an actor-critic."""
    target = cfg.baseline._target_
    return bool(target) and issubclass(import_class("baseline._target_", target), ActorCriticAgent)


class Policy(Trained):
    """Stage of the network of an actor-critic agent."""

    kind = "train/policy"
    node = "algorithm"
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
        return MONITOR

    def check(self) -> None:
        """Refuse an agent that does not learn, and recipes that cannot work."""
        if not learns(self.cfg):
            raise UserError(
                f"baseline: that of agent '{self.cfg.agent.name}' is no actor-critic; choose "
                "model=a3c_va"
            )
        super().check()
        check_name("agent.name", self.cfg.agent.name)
        recipe = build_algorithm(self.cfg)
        if self.cfg.numerics == PORTABLE and getattr(recipe, "update_order", "") == "free":
            raise UserError(
                "numerics: portable needs algorithm.update_order=round_robin, for with free the "
                "weights depend on which worker is faster"
            )
        if self.start is not None and not self.begun():
            from avn.rl.checkpoints import read_start

            read_start(self.start, recipe)
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
        protocol = self.cfg.protocol
        radius = protocol.goal != "radius"
        # the default cap enters no fingerprint
        cap = protocol.max_moves_ratio is None or protocol.cap == Protocol.cap
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
            *(("protocol.cap",) if cap else ()),
            *(() if has_sound_model(self.cfg) else ("algorithm.realisations",)),
        ]

    def consulted(self) -> Sequence[str]:
        """Return the key of the cap, where there is one."""
        capped = self.cfg.protocol.max_moves_ratio is not None
        return (*super().consulted(), *(("protocol.cap",) if capped else ()))

    def content(self) -> Any:
        """Return the meaning of the goal, where it has changed."""
        return GOAL_MEANINGS.get(self.cfg.protocol.goal)

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
        started = time.perf_counter()
        curve, features = self._train(build_algorithm(self.cfg), self.folder, self.loggers)
        self._warn(curve)
        metrics: dict[str, Any] = {f"best/{key}": own for key, own in best_of(curve).items()}
        metrics |= {f"untrained/{name}": value for name, value in curve[0].items()}
        metrics |= {"features": features, "steps": curve[-1]["steps"]}
        metrics |= {"seconds": time.perf_counter() - started}
        nodes = {name: plain(self.cfg, name) for name in ("baseline", "algorithm", "protocol")}
        self.finish(metrics, nodes)

    def trial(self, batches: int) -> None:
        """Train a few batches of each worker, and measure with one start of each source."""
        recipe = build_algorithm(self.cfg)
        steps = batches * recipe.batch * recipe.workers
        short = dataclasses.replace(recipe, total_steps=steps, validation_starts=1)
        with TemporaryDirectory() as parent:
            self._train(short, Path(parent) / self.folder.name, lambda step: [])

    def _train(
        self, recipe: Algorithm, folder: Path, loggers: Callable[[int], Sequence[Logger]]
    ) -> tuple[list[dict[str, float]], dict[str, int]]:
        """Train in a folder; return the curve, and the size of each feature."""
        from avn.pipeline.policy_training import prepare
        from avn.rl.training import Training

        spec, network, measure = prepare(self.cfg, recipe)
        training = Training(spec, network, folder, measure, self.fingerprint, loggers, self.start)
        return training.run(), spec.network_spec.features

    def _warn(self, curve: Sequence[dict[str, float]]) -> None:
        """Warn where the kept network is no better on validation than the untrained one."""
        best, untrained = best_of(curve), curve[0]
        if best[MONITOR] > untrained[MONITOR]:
            return
        log(
            f"warning: {self.folder}: no network was better on validation than the untrained one "
            f"({MONITOR} {untrained[MONITOR]:.3f}); the one after {best['steps']:.0f} steps is "
            f"kept ({best[MONITOR]:.3f}); give more algorithm.total_steps, more "
            "algorithm.validation_starts, or a split with more validation apartments"
        )

    def load(self) -> ActorCritic:
        """Return the trained network, set to evaluation.

        Raises
        ------
        UserError
            Where a checkpoint belongs to another config, or has changed since it was trained.
        """
        from avn.rl.checkpoints import BEST, load_network
        from avn.rl.networks import ActorCritic

        network = ActorCritic(network_spec(self.cfg, self._feature_sizes()))
        if self.published:
            network.load_state_dict(self.published.weights())
            return network.eval()
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
