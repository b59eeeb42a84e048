"""Scenes and observations of actor-critic agents in the training world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from omegaconf import DictConfig

from avn.agents.actor_critic import ActorCriticAgent
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.dataset.scene import Scene
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.scene_batch import SceneBatch, build_scene_batch
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.audio_inference import SELECTION_CLIPS, TRAINING_CLIPS
from avn.pipeline.observation_table import OBSERVATIONS
from avn.pipeline.observations import Observed
from avn.pipeline.occupancy import has_occupancy_model
from avn.pipeline.scenes import Geometry
from avn.pipeline.sound_network import has_sound_model
from avn.pipeline.sounds import sound_files
from avn.pipeline.stage import Stage

if TYPE_CHECKING:
    from avn.rl.algorithm import Algorithm
    from avn.rl.networks import ActorCritic, NetworkSpec

SUBSETS = ("train", "validation")


def parts(cfg: DictConfig) -> dict[str, Any]:
    """Return the arguments of an actor-critic agent that are not in its node, without network."""
    return {
        "hears": has_sound_model(cfg),
        "maps": has_occupancy_model(cfg),
    }


def actor_critic(cfg: DictConfig, network: ActorCritic | None = None) -> ActorCriticAgent:
    """Build the actor-critic agent of a config, with a network if it shall act."""
    agent: ActorCriticAgent = build_object(
        "baseline", cfg.baseline, network=network, map_size=cfg.mapper.size, **parts(cfg)
    )
    return agent


def observation_names(cfg: DictConfig) -> tuple[str, ...]:
    """Return the names of the observations that the actor-critic of a config needs."""
    return actor_critic(cfg).wants(build_object("protocol", cfg.protocol))


def feature_sizes(cfg: DictConfig, tables: SceneBatch) -> dict[str, int]:
    """Return the sizes of the features of a config's network, by name, in their order.

    Local patches become a map if the agent has one; they are no features of the network then.
    """
    both = {**tables.visual, **tables.audio}
    mapped = ("local_patch",) if has_occupancy_model(cfg) else ()
    names = [name for name in observation_names(cfg) if name in both and name not in mapped]
    return {name: both[name][0].numel() for name in names}


def observed(cfg: DictConfig, subset: str) -> Observed:
    """Return the observations of an actor-critic in a subset of the training world."""
    names = observation_names(cfg)
    clips = TRAINING_CLIPS if subset == "train" else SELECTION_CLIPS
    return Observed(Apartments(cfg, subset, TRAINING), names, clips)


def check_observations(cfg: DictConfig) -> None:
    """Refuse observations of an actor-critic that do not exist, or that no table can hold."""
    names, agent = observation_names(cfg), str(cfg.baseline._target_).rpartition(".")[2]
    observed(cfg, "train").check(agent, names)
    for name in names:
        if name in OBSERVATIONS and OBSERVATIONS[name].rendered:
            tables = [own for own, each in OBSERVATIONS.items() if not each.rendered]
            raise UserError(
                f"agent {agent} needs the observation '{name}', which is rendered at each step, "
                f"and avn.train learns from {', '.join(tables)}; train in avn.make_env instead"
            )


def subset_stages(cfg: DictConfig, subset: str) -> list[Stage]:
    """Return the stages of a training-world subset's geometry and observations."""
    geometry = Geometry(cfg, Apartments(cfg, subset, TRAINING))
    return [geometry, *observed(cfg, subset).stages.values()]


def load_subset(cfg: DictConfig, subset: str) -> tuple[list[Scene], list[SceneObservations]]:
    """Load the scenes of a subset of the training world and the observations in each."""
    scenes = Geometry(cfg, Apartments(cfg, subset, TRAINING)).load()
    return scenes, observed(cfg, subset).load(scenes)


def tables_of(cfg: DictConfig, opened: tuple[list[Scene], list[SceneObservations]]) -> SceneBatch:
    """Return the apartments of `load_subset` as tables, under the protocol of the config."""
    scenes, observations = opened
    sounds = len(sound_files(cfg, TRAINING))
    return build_scene_batch(scenes, build_object("protocol", cfg.protocol), observations, sounds)


def build_algorithm(cfg: DictConfig) -> Algorithm:
    """Build the algorithm of a config; raise `UserError` where there is none, or it cannot work."""
    if not cfg.algorithm._target_:
        raise UserError("algorithm: 'none' trains nothing; choose a3c")
    algorithm: Algorithm = build_object("algorithm", cfg.algorithm)
    return algorithm


def network_spec(cfg: DictConfig, features: dict[str, int]) -> NetworkSpec:
    """Return the sizes of the network of a config, for features of some sizes."""
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
