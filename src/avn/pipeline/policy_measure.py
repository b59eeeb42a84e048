"""Evaluation of an actor-critic on training and validation apartments, during its training."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import pandas as pd
from omegaconf import DictConfig, OmegaConf

from avn.agents.rollout import Labels, rollout_scene
from avn.dataset.scene import Scene
from avn.navigation.episodes import frozen_episodes
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.pipeline.apartments import TRAINING
from avn.pipeline.policy_data import actor_critic
from avn.pipeline.sounds import sound_files

if TYPE_CHECKING:
    from avn.rl.networks import ActorCritic

# Seed of the episodes on which an agent is evaluated during training.
MEASURED_SEED = 0


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
    starts : int
        Episodes of each source and sound.
    """

    def __init__(
        self, cfg: DictConfig, observed: dict[str, Any], protocol: Protocol, starts: int
    ) -> None:
        self._cfg, self._observed = cfg, observed
        self._protocol = dataclasses.replace(protocol, num_starts=starts)
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
