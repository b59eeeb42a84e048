"""What changes in the course of an episode, by the config."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from omegaconf import DictConfig

from avn.apartments.floor_plan import FloorPlan
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.navigation.dynamics import Dynamics
from avn.pipeline.sounds import sound_categories, sound_files

# Groups of the config, as the attributes of `Dynamics`, and the options by which nothing changes.
STEADY = {"schedule": "continuous", "distractor": "none", "odometry": "exact", "motion": "still"}
GROUPS = tuple(STEADY)


def changing(cfg: DictConfig) -> tuple[str, ...]:
    """Return the groups by which something changes in the course of an episode."""
    return tuple(group for group in GROUPS if cfg[group]._target_)


def build_dynamics(cfg: DictConfig) -> Dynamics:
    """Build what changes in the course of an episode; raise `UserError` for an invalid setting."""
    given: dict[str, dict[str, Any]] = {"distractor": {"categories": sound_categories(cfg)}}
    return Dynamics(
        **{
            group: build_object(group, cfg[group], **given.get(group, {}))
            for group in changing(cfg)
        }
    )


def check_dynamics(cfg: DictConfig, plans: Sequence[FloorPlan]) -> None:
    """Refuse settings with which an episode in one of the apartments could not be drawn."""
    if distractor := build_dynamics(cfg).distractor:
        for plan in plans:
            try:
                distractor.check(len(plan.sources), list(sound_files(cfg)))
            except UserError as error:
                raise UserError(f"{error} (apartment '{plan.name}')") from None
