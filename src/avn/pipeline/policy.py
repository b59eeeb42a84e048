"""The actor-critic agents of a config, trained where they are missing."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.agents.actor_critic import ActorCriticAgent, ActorCriticConfig
from avn.agents.rollout import Labels, walk_room
from avn.core.errors import UserError
from avn.core.files import check_name, stage_folder, written_whole
from avn.core.hashing import digest, file_hash
from avn.dataset import build
from avn.dataset.scene import Scene
from avn.navigation.episodes import frozen_episodes
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.starts import build_starts
from avn.navigation.tables import Tables, build_tables
from avn.navigation.world import World
from avn.pipeline import (
    audio_features,
    audio_inference,
    occupancy,
    scenes,
    sound_network,
    visual_features,
)
from avn.pipeline.audio_features import Clips
from avn.pipeline.stage import make_once
from avn.pipeline.trained import CHECKSUM, METRICS, apartments, read_metrics
from avn.reporting.model_card import write_card
from avn.rl.a3c import BEST, MONITOR, Training, load_network
from avn.rl.config import A3CConfig, check_recipe
from avn.rl.explorations import draw_walks
from avn.rl.networks import ActorCritic, Shape
from avn.rl.worker import Task

# Raised when the code of training changes its result.
VERSION = 1
# Draws the episodes on which an agent is measured while it learns.
MEASURED_SEED = 0
PARTS = ("train", "validation")
# Numbers from which the mean and spread of a feature are taken.
_EXAMPLES = 200_000


def learns(cfg: DictConfig) -> bool:
    """Whether the config's agent is an actor-critic."""
    return OmegaConf.get_type(cfg.baseline) is ActorCriticConfig


def policy_hash(cfg: DictConfig) -> str:
    """Hash of what the weights of the agent depend on."""
    views = scenes.views_hashes(cfg, PARTS)
    observed: list[Any] = [[visual_features.features_hash(cfg, v) for v in views[p]] for p in PARTS]
    if sound_network.hears(cfg):
        acoustics = scenes.acoustics_of(cfg)
        plans = scenes.plans(cfg)
        observed += [build.first_arrival_hash(plan, acoustics) for p in PARTS for plan in plans[p]]
        observed += [audio_features.features_hash(cfg, clips_of(cfg, part)) for part in PARTS]
    if occupancy.sees_windows(cfg):
        observed += [occupancy.see_hash(cfg), cfg.mapper.visible_above, cfg.mapper.size]
    node: Any = OmegaConf.to_container(cfg.baseline, resolve=True)
    node.pop("samples")
    return digest(observed, cfg.protocol, node, cfg.a3c, VERSION)


def policy(cfg: DictConfig, asked: bool = False) -> tuple[ActorCritic, Path]:
    """The trained network of the config's agent and its folder; trains it where it is missing.

    Parameters
    ----------
    asked : bool
        Whether it is the network that the user asked for, so that `auto=false` does not refuse it.

    Raises
    ------
    UserError
        Where the agent is no actor-critic, a checkpoint belongs to another config, or something is
        missing and `auto` is false.
    """
    if not learns(cfg):
        raise UserError(f"agent: '{cfg.agent.name}' is no actor-critic; choose model=a3c_va")
    check_name("agent.name", cfg.agent.name)
    recipe: A3CConfig = check_recipe(scenes.typed(cfg.a3c))
    made_from = policy_hash(cfg)
    folder = stage_folder(cfg.outputs, "train", cfg.agent.name, made_from)
    make_once(
        folder,
        f"agent '{cfg.agent.name}' ({_settings(cfg)})",
        done=(folder / METRICS).is_file,
        make=lambda: _train(cfg, recipe, folder, made_from),
        auto=cfg.auto or asked,
        seconds=_training_time(cfg),
    )
    network = ActorCritic(_shape(cfg, _feature_sizes(folder)))
    load_network(network, folder / BEST, made_from)
    if read_metrics(folder).get(CHECKSUM) != file_hash(folder / BEST):
        raise UserError(f"{folder / BEST}: changed since it was trained; delete {folder}")
    return network.eval(), folder


def _settings(cfg: DictConfig) -> str:
    """What tells networks of one row apart, in words."""
    return f"{cfg.acoustics.name}, {cfg.protocol.name}, train_seed {cfg.a3c.train_seed}"


def _training_time(cfg: DictConfig) -> float:
    """Seconds that training takes on two cores, roughly."""
    microseconds = 30 + 30 * occupancy.sees_windows(cfg) + 30 * bool(cfg.baseline.memory)
    return float(cfg.a3c.total * microseconds / 1e6 * 1.6)


def parts(cfg: DictConfig, ready: bool) -> dict[str, Any]:
    """What the agent is built of beside its own node; with `ready`, its trained network."""
    given = {
        "hears": sound_network.hears(cfg),
        "maps": occupancy.sees_windows(cfg),
        "map_size": cfg.mapper.size,
    }
    return given | ({"network": policy(cfg)[0]} if ready else {})


def observed_names(cfg: DictConfig) -> tuple[str, ...]:
    """What the config's agent observes, by the names of `avn.rl.environment.WalkEnv`."""
    heard = ("sound_feature",) if sound_network.hears(cfg) else ()
    return ("feature", *heard, *(("map",) if occupancy.sees_windows(cfg) else ()))


def open_tables(cfg: DictConfig, part: str) -> tuple[Tables, Protocol, A3CConfig]:
    """The apartments of a part as tables, with the rules and the recipe.

    Raises
    ------
    UserError
        Where `part` is none of `PARTS`.
    """
    if part not in PARTS:
        raise UserError(f"part: '{part}' is none of {', '.join(PARTS)}")
    protocol: Protocol = instantiate(cfg.protocol)
    rooms, hearing, sights = _observed(cfg, part)
    tables = build_tables(rooms, protocol, hearing, sights, len(audio_inference.TRAINING_SOUNDS))
    return tables, protocol, check_recipe(scenes.typed(cfg.a3c))


def free_world(
    tables: Tables, protocol: Protocol, recipe: A3CConfig, n: int, max_steps: int | None
) -> World:
    """N episodes in the apartments of tables, without exploration."""
    starts = build_starts(tables)
    return World(tables, starts, n, protocol, max_steps, recipe.reward, recipe.train_seed)


def clips_of(cfg: DictConfig, part: str) -> Clips:
    """What is heard in the apartments of a part: the built-in sounds, whatever `sound` says."""
    if part == "train":
        return Clips(audio_inference.TRAINING_SOUNDS, cfg.a3c.takes, "train")
    return Clips(audio_inference.TRAINING_SOUNDS, cfg.takes)


def _shape(cfg: DictConfig, features: dict[str, int]) -> Shape:
    protocol: Protocol = instantiate(cfg.protocol)
    maps = occupancy.sees_windows(cfg)
    return Shape(
        features=features,
        actions=protocol.actions,
        width=cfg.baseline.width,
        memory=cfg.baseline.memory,
        map_channels=maps * (2 if cfg.baseline.memory else 1),
        map_width=cfg.baseline.map_width,
    )


def _feature_sizes(folder: Path) -> dict[str, int]:
    """Sizes of the features that a trained agent takes, as its metrics say."""
    sizes = read_metrics(folder).get("features")
    if not isinstance(sizes, dict):
        raise UserError(f"{folder / METRICS}: damaged; delete {folder} to train again")
    return {str(name): int(size) for name, size in sizes.items()}


def _observed(cfg: DictConfig, part: str) -> tuple[list[Scene], list[Any], list[Any]]:
    """Scenes of a part, with what is heard and what is seen in each."""
    rooms = scenes.scenes(cfg, (part,), audible=sound_network.hears(cfg))[part]
    hearing: list[dict[str, Tensor]] = [{} for _ in rooms]
    sights: list[dict[str, Tensor]] = [{} for _ in rooms]
    for own, found in zip(sights, visual_features.features(cfg, (part,))[part], strict=True):
        own["feature"] = found
    if sound_network.hears(cfg):
        heard = audio_features.sound_features(cfg, rooms, clips_of(cfg, part))
        for own, found in zip(hearing, heard, strict=True):
            own["sound_feature"] = found
    if occupancy.sees_windows(cfg):
        for own, found in zip(sights, occupancy.trusted_windows(cfg, rooms), strict=True):
            own["window"] = found
    return rooms, hearing, sights


def _train(cfg: DictConfig, recipe: A3CConfig, folder: Path, made_from: str) -> None:
    """Train, and write what was measured."""
    started = time.perf_counter()
    protocol: Protocol = instantiate(cfg.protocol)
    observed = {part: _observed(cfg, part) for part in PARTS}
    rooms, hearing, sights = observed["train"]
    tables = build_tables(rooms, protocol, hearing, sights, len(audio_inference.TRAINING_SOUNDS))
    features = _sizes(tables)
    shape = _shape(cfg, features)
    torch.manual_seed(recipe.train_seed)
    network = ActorCritic(shape)
    for name in features:
        table = tables.sights.get(name, tables.hearing.get(name))
        assert table is not None
        network.standardise(name, table[:: max(1, len(table) // _EXAMPLES)])
    task = Task(
        tables=tables,
        protocol=protocol,
        shape=shape,
        recipe=recipe,
        buffers=dict(network.named_buffers()),
        map_size=cfg.mapper.size,
        walks=_walks(cfg, rooms, tables),
        top=cfg.baseline.top,
    )
    measure = Measure(cfg, observed, protocol)
    curve = Training(task, network, folder, measure, made_from).run()
    best = max(curve, key=lambda own: own[MONITOR])
    metrics: dict[str, Any] = {f"best/{name}": value for name, value in best.items()}
    metrics |= {f"untrained/{name}": value for name, value in curve[0].items()}
    metrics |= {"features": features, "steps": curve[-1]["steps"]}
    metrics |= {"seconds": time.perf_counter() - started, CHECKSUM: file_hash(folder / BEST)}
    with written_whole(folder / METRICS) as part:
        part.write_text(json.dumps(metrics, indent=1, sort_keys=True) + "\n")
    title = f"Actor-critic agent '{cfg.agent.name}' ({_settings(cfg)})"
    recipe_of = {"baseline": cfg.baseline, "a3c": cfg.a3c, "protocol": cfg.protocol}
    plain = {name: OmegaConf.to_container(node, resolve=True) for name, node in recipe_of.items()}
    write_card(folder, title, apartments(cfg), plain, metrics)


def _sizes(tables: Tables) -> dict[str, int]:
    """Sizes of what a network takes as features, by name."""
    both = {**tables.sights, **tables.hearing}
    return {
        name: int(both[name].shape[-1]) for name in ("feature", "sound_feature") if name in both
    }


def _walks(cfg: DictConfig, rooms: Sequence[Scene], tables: Tables) -> Tensor | None:
    steps = cfg.protocol.exploration
    if not cfg.baseline.memory:
        return None
    if not steps:
        raise UserError("protocol.exploration: 0, and an agent with memory explores; give 400")
    return draw_walks([*rooms], tables, cfg.a3c.walks, steps, cfg.a3c.train_seed)


def _returns(walked: pd.DataFrame, reward: RewardConfig) -> pd.Series:
    """What each episode would have earned in training, not discounted."""
    success, collisions = walked["success"], walked["collisions"]
    others = walked["actions"] - success - collisions
    return success * reward.success + collisions * reward.collision + others * reward.step


class Measure:
    """How a network does on training and validation apartments, under the protocol."""

    def __init__(self, cfg: DictConfig, observed: dict[str, Any], protocol: Protocol) -> None:
        self._cfg, self._observed = cfg, observed
        self._protocol = dataclasses.replace(protocol, starts=cfg.a3c.validation_starts)
        self._labels = Labels(agent=cfg.agent.name, acoustics=cfg.acoustics.name)

    def __call__(self, network: ActorCritic) -> dict[str, float]:
        """Return, success rate and SPL, such as `validation/spl`."""
        found = {}
        given = parts(self._cfg, ready=False)
        options: Any = OmegaConf.to_container(self._cfg.baseline, resolve=True)
        options.pop("_target_")
        agent = ActorCriticAgent(network, **options, **given)
        for part, (rooms, hearing, sights) in self._observed.items():
            name = "training" if part == "train" else part
            walked = pd.concat(
                walk_room(agent, room, self._episodes(room), self._protocol, self._labels, *senses)
                for room, *senses in zip(rooms, hearing, sights, strict=True)
            )
            found[f"{name}/return"] = float(_returns(walked, self._cfg.a3c.reward).mean())
            found[f"{name}/success"] = float(walked["success"].mean())
            found[f"{name}/spl"] = float(walked["spl"].mean())
        return found

    def _episodes(self, room: Scene) -> Any:
        sounds = list(audio_inference.TRAINING_SOUNDS)
        return frozen_episodes(room, sounds, self._protocol, MEASURED_SEED)
