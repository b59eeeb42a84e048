"""Configs of the rows of a table, composed as by `avn.eval`."""

from __future__ import annotations

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from avn.config import spare
from avn.config.audio_source import name_files
from avn.config.spare import compose_fitting
from avn.core.errors import UserError

# Overrides of `avn.reproduce` itself.
_OWN = (
    *("rows", "seeds", "train_seeds", "sounds", "experiment"),
    *("table", "conditions", "world"),
)


def compose_row(cfg: DictConfig, row: str, condition: str = "none") -> DictConfig:
    """Compose the config of a row, with the overrides and the sounds of the command line.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.reproduce`.
    row : str
        Option of the group `agent`.
    condition : str
        Option of the group `condition`.

    Raises
    ------
    UserError
        For a sound that the row's config does not have.
    """
    shared = [o for o in HydraConfig.get().overrides.task if o.split("=")[0] not in _OWN]
    given = {override.split("=")[0] for override in shared}
    world = [override for override in cfg.world if override.split("=")[0] not in given]
    chosen = [f"agent={row}", f"condition={condition}"]
    config = compose_fitting("eval", [*world, *shared, *spare.settings(), *chosen])
    name_files(config)
    for name in cfg.sounds:
        if name not in config.sound:
            raise UserError(f"sounds: '{name}' is none of {', '.join(config.sound)}")
    if cfg.sounds:
        config.sound = {name: config.sound[name] for name in cfg.sounds}
    return config
