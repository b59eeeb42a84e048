"""Actor-critic agents: their networks, trained where agents act, as a stage."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from typing import Any

import pandas as pd
import torch
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.agents.actor_critic import ActorCriticAgent
from avn.agents.rollout import Labels, rollout_scene
from avn.core.classes import build_object, import_class
from avn.core.errors import UserError
from avn.core.files import check_name
from avn.core.settings import plain
from avn.dataset.scene import Scene
from avn.mapping.ego_map import EgoMap
from avn.navigation.episodes import frozen_episodes
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.scene_batch import SceneBatch, build_scene_batch
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.audio_inference import Clips
from avn.pipeline.observations import Observed
from avn.pipeline.occupancy import sees_windows
from avn.pipeline.scenes import Geometry
from avn.pipeline.sound_network import hears
from avn.pipeline.sounds import sound_files
from avn.pipeline.stage import Stage
from avn.pipeline.trained import METRICS, Trained
from avn.rl.algorithm import Algorithm
from avn.rl.exploration_memory import draw_walks
from avn.rl.networks import ActorCritic, NetworkSpec
from avn.rl.training import BEST, MONITOR, Training, load_network
from avn.rl.worker import TrainingSpec

# Draws the episodes on which an agent is measured while it learns.
MEASURED_SEED = 0
PARTS = ("train", "validation")
# Numbers from which the mean and spread of a feature are taken.
_EXAMPLES = 200_000


def learns(cfg: DictConfig) -> bool:
    """Whether the config's agent is an actor-critic."""
    target = cfg.baseline._target_
    return bool(target) and issubclass(import_class("baseline._target_", target), ActorCriticAgent)


def build_algorithm(cfg: DictConfig) -> Algorithm:
    """The algorithm of a config; raises `UserError` where there is none, or it cannot work."""
    if not cfg.algorithm._target_:
        raise UserError("algorithm: 'none' trains nothing; choose a3c")
    algorithm: Algorithm = build_object("algorithm", cfg.algorithm)
    return algorithm


def parts(cfg: DictConfig) -> dict[str, Any]:
    """What an actor-critic is built of beside its own node and its network."""
    return {"hears": hears(cfg), "maps": sees_windows(cfg), "map_size": cfg.mapper.size}


class Policy(Trained):
    """The network of an actor-critic agent."""

    kind = "train/policy"

    @property
    def name(self) -> str:
        """The name of the row, which names the folder."""
        return str(self.cfg.agent.name)

    def check(self) -> None:
        """Refuse an agent that does not learn, and recipes that cannot work."""
        if not learns(self.cfg):
            raise UserError(
                f"agent: '{self.cfg.agent.name}' is no actor-critic; choose model=a3c_va"
            )
        check_name("agent.name", self.cfg.agent.name)
        build_algorithm(self.cfg)
        if self.cfg.baseline.memory and not self.cfg.protocol.exploration_steps:
            raise UserError(
                "protocol.exploration_steps: 0, and an agent with memory explores; give 400"
            )
        if sees_windows(self.cfg):
            EgoMap(1, self.cfg.mapper.size, self.cfg.baseline.map_width)

    def needs(self) -> Sequence[Any]:
        """What it observes in the training and in the validation apartments."""
        return [stage for part in PARTS for stage in part_stages(self.cfg, part)]

    def settings(self) -> Sequence[str]:
        """Its shape, the recipe, and the rules of the episodes."""
        maps = ("mapper.size",) if sees_windows(self.cfg) else ()
        shaped = observed(self.cfg, "train").settings
        # its name names the folder, so that two rows never share one
        return ("agent.name", "baseline", "algorithm", "protocol", *maps, *shaped)

    def ignored(self) -> Sequence[str]:
        """How it acts once it is trained, and what agents without memory or map have not."""
        memory, maps = self.cfg.baseline.memory, sees_windows(self.cfg)
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
            *(() if hears(self.cfg) else ("algorithm.realisations",)),
        ]

    @property
    def title(self) -> str:
        """What it is."""
        acoustics, seed = self.train.node("acoustics").name, self.cfg.algorithm.train_seed
        settings = f"{acoustics}, {self.cfg.protocol.name}, train_seed {seed}"
        return f"agent '{self.cfg.agent.name}' ({settings})"

    def seconds(self) -> float:
        """By the number of actions and what is computed for each."""
        microseconds = 30 + 30 * sees_windows(self.cfg) + 30 * bool(self.cfg.baseline.memory)
        return float(self.cfg.algorithm.total_steps * microseconds / 1e6 * 1.6)

    def make(self) -> None:
        """Train it, or go on where a killed training was."""
        _train(self)

    def load(self) -> ActorCritic:
        """The trained network, set to evaluation.

        Raises
        ------
        UserError
            Where a checkpoint belongs to another config, or has changed since it was trained.
        """
        network = ActorCritic(_shape(self.cfg, self._feature_sizes()))
        load_network(network, self.folder / BEST, self.fingerprint)
        self.check_weights()
        return network.eval()

    def _feature_sizes(self) -> dict[str, int]:
        sizes = self.metrics().get("features")
        if not isinstance(sizes, dict):
            raise UserError(
                f"{self.folder / METRICS}: damaged; delete {self.folder} to train again"
            )
        return {str(name): int(size) for name, size in sizes.items()}


def observed(cfg: DictConfig, part: str) -> Observed:
    """What an actor-critic observes in a part of the training world."""
    given = parts(cfg)
    names = ActorCriticAgent(hears=given["hears"], maps=given["maps"]).wants(
        build_object("protocol", cfg.protocol)
    )
    clips = Clips("algorithm.realisations", "train") if part == "train" else Clips()
    return Observed(Apartments(cfg, part, TRAINING), names, clips)


def part_stages(cfg: DictConfig, part: str) -> list[Stage]:
    """Geometry of a part of the training world, and what makes the observations there."""
    geometry = Geometry(cfg, Apartments(cfg, part, TRAINING))
    return [geometry, *observed(cfg, part).stages.values()]


def load_part(cfg: DictConfig, part: str) -> tuple[list[Scene], list[SceneObservations]]:
    """Scenes of a part of the training world, with what is observed in each."""
    scenes = Geometry(cfg, Apartments(cfg, part, TRAINING)).load()
    return scenes, observed(cfg, part).load(scenes)


def tables_of(cfg: DictConfig, opened: tuple[list[Scene], list[SceneObservations]]) -> SceneBatch:
    """The apartments of `load_part` as tables, under the protocol of the config."""
    rooms, observations = opened
    sounds = len(sound_files(cfg, TRAINING))
    return build_scene_batch(rooms, build_object("protocol", cfg.protocol), observations, sounds)


def _shape(cfg: DictConfig, features: dict[str, int]) -> NetworkSpec:
    protocol: Protocol = build_object("protocol", cfg.protocol)
    return NetworkSpec(
        features=features,
        actions=protocol.actions,
        width=cfg.baseline.width,
        memory=cfg.baseline.memory,
        map_channels=sees_windows(cfg) * (2 if cfg.baseline.memory else 1),
        map_width=cfg.baseline.map_width,
    )


def _train(policy: Policy) -> None:
    """Train, and write what was measured."""
    started = time.perf_counter()
    cfg, recipe = policy.cfg, build_algorithm(policy.cfg)
    opened = {part: load_part(cfg, part) for part in PARTS}
    tables = tables_of(cfg, opened["train"])
    features = _sizes(tables)
    shape = _shape(cfg, features)
    torch.manual_seed(recipe.train_seed)
    network = ActorCritic(shape)
    for name in features:
        table = tables.visual.get(name, tables.audio.get(name))
        assert table is not None
        network.standardise(name, table[:: max(1, len(table) // _EXAMPLES)])
    protocol: Protocol = build_object("protocol", cfg.protocol)
    spec = TrainingSpec(
        tables=tables,
        protocol=protocol,
        shape=shape,
        recipe=recipe,
        buffers=dict(network.named_buffers()),
        map_size=cfg.mapper.size,
        walks=_walks(cfg, opened["train"][0], tables),
        top=cfg.baseline.top,
    )
    measure = Measure(cfg, opened, protocol)
    curve = Training(spec, network, policy.folder, measure, policy.fingerprint).run()
    best = max(curve, key=lambda own: own[MONITOR])
    metrics: dict[str, Any] = {f"best/{name}": value for name, value in best.items()}
    metrics |= {f"untrained/{name}": value for name, value in curve[0].items()}
    metrics |= {"features": features, "steps": curve[-1]["steps"]}
    metrics |= {"seconds": time.perf_counter() - started}
    policy.finish(
        metrics, {name: plain(cfg, name) for name in ("baseline", "algorithm", "protocol")}
    )


def _sizes(tables: SceneBatch) -> dict[str, int]:
    """Sizes of what a network takes as features, by name."""
    both = {**tables.visual, **tables.audio}
    return {
        name: int(both[name].shape[-1])
        for name in ("visual_embedding", "audio_embedding")
        if name in both
    }


def _walks(cfg: DictConfig, rooms: Sequence[Scene], tables: SceneBatch) -> Tensor | None:
    if not cfg.baseline.memory:
        return None
    steps = cfg.protocol.exploration_steps
    return draw_walks(
        [*rooms], tables, cfg.algorithm.exploration_walks, steps, cfg.algorithm.train_seed
    )


def _returns(walked: pd.DataFrame, reward: RewardConfig) -> pd.Series:
    """What each episode would have earned in training, not discounted."""
    success, collisions = walked["success"], walked["collisions"]
    others = walked["actions"] - success - collisions
    return success * reward.success + collisions * reward.collision + others * reward.step


class Measure:
    """How a network does on training and validation apartments, under the protocol."""

    def __init__(self, cfg: DictConfig, observed: dict[str, Any], protocol: Protocol) -> None:
        self._cfg, self._observed = cfg, observed
        self._protocol = dataclasses.replace(protocol, num_starts=cfg.algorithm.validation_starts)
        acoustics = OmegaConf.select(cfg, TRAINING.acoustics).name
        self._labels = Labels(agent=cfg.agent.name, acoustics=acoustics)

    def __call__(self, network: ActorCritic) -> dict[str, float]:
        """Return, success rate and SPL, such as `validation/spl`."""
        found = {}
        given, options = parts(self._cfg), plain(self._cfg, "baseline")
        options.pop("_target_")
        options["samples"] = True  # how it acts once it is trained chooses no network
        agent = ActorCriticAgent(network, **options, **given)
        for part, (rooms, observations) in self._observed.items():
            name = "training" if part == "train" else part
            walked = pd.concat(
                rollout_scene(agent, room, self._episodes(room), self._protocol, self._labels, own)
                for room, own in zip(rooms, observations, strict=True)
            )
            found[f"{name}/return"] = float(_returns(walked, self._cfg.algorithm.reward).mean())
            found[f"{name}/success"] = float(walked["success"].mean())
            found[f"{name}/spl"] = float(walked["spl"].mean())
        return found

    def _episodes(self, room: Scene) -> Any:
        sounds = list(sound_files(self._cfg, TRAINING))
        return frozen_episodes(room, sounds, self._protocol, MEASURED_SEED)
