"""Category of the goal's sound, where the agent is told it."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.core.errors import UserError
from avn.pipeline.sounds import sound_categories


def is_told(cfg: DictConfig) -> bool:
    """Return whether the agent is told the category of the goal's sound."""
    return bool(cfg.distractor.get("told"))


def can_be_told(cfg: DictConfig) -> bool:
    """Return whether the sound network can be told a category, or nobody tells it one."""
    return bool(cfg.sound_model.get("categories")) or not is_told(cfg)


def told_categories(cfg: DictConfig) -> Tensor:
    """Return what a `ToldArrivalCnn` is told of each sound, (sounds,) int64."""
    known = list(cfg.sound_model.categories)
    return torch.tensor([known.index(name) + 1 for name in sound_categories(cfg).values()])


def check_told(cfg: DictConfig, agent: str, wanted: Sequence[str]) -> None:
    """Refuse to tell an agent that cannot be told, and a category that it does not know.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    agent : str
        Name of the agent, for messages.
    wanted : sequence of str
        Names of the observations that the agent needs.

    Raises
    ------
    UserError
        For such an agent, and for such a category.
    """
    if not is_told(cfg):
        return
    if "arrival" not in wanted or not can_be_told(cfg):
        raise UserError(
            f"distractor.told: agent {agent} cannot be told a category; take one whose sound "
            "network can, such as agent=belief_told, or distractor.told=false"
        )
    for sound, category in sound_categories(cfg).items():
        if category not in cfg.sound_model.categories:
            raise UserError(
                f"distractor.told: the sound network knows no category '{category}' ({sound}); "
                "give sounds of sound_model.categories, or distractor.told=false"
            )
