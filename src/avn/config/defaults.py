"""Default config of a run: its row and its options as the package defines them."""

from __future__ import annotations

from functools import lru_cache

from hydra import compose
from omegaconf import DictConfig, OmegaConf

from avn.config import option_files
from avn.config.folder import conf_folder
from avn.config.python import composing

# Groups whose options a run names, and those that are of its condition if it has one.
_GROUPS = ("agent", "split", "acoustics", "protocol")
_OF_CONDITIONS = ("schedule", "distractor", "odometry", "motion")


def default_config(cfg: DictConfig, condition: str = "none") -> DictConfig:
    """Return the config of a run's row in its world, as the package defines the two.

    The world is the options of split, acoustics and protocol, and of what changes in an episode.
    Options are those of the package: a name that the package does not have is left at its default,
    so that a row or an option of the user differs from what is returned.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    condition : str
        Option of the group `condition` with which it was composed: what changes in an episode is
        then that of the condition.
    """
    groups = _GROUPS if condition != "none" else (*_GROUPS, *_OF_CONDITIONS)
    named = [(group, str(OmegaConf.select(cfg, f"{group}.name"))) for group in groups]
    named.append(("condition", condition))
    return _composed(
        tuple(
            f"{group}={name}"
            for group, name in named
            if (conf_folder() / group / f"{name}.yaml").is_file()
        )
    )


@lru_cache(maxsize=64)
def _composed(overrides: tuple[str, ...]) -> DictConfig:
    with option_files.package_only(), composing():
        return compose("eval", overrides=[*overrides])
