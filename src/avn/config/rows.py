"""Configs of the rows of a table, composed as `avn.eval` composes them."""

from __future__ import annotations

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from avn.config import spare
from avn.config.spare import compose_fitting
from avn.core.errors import UserError

# Overrides that belong to this command and not to a row.
_OWN = ("rows", "seeds", "train_seeds", "sounds", "experiment")


def compose_row(cfg: DictConfig, row: str) -> DictConfig:
    """The config of a row, with the options of the command line and the sounds that are named.

    Parameters
    ----------
    cfg : DictConfig
        Of `avn.reproduce`.
    row : str
        An option of the group `agent`.

    Raises
    ------
    UserError
        For a sound that the row's config does not have.
    """
    shared = [o for o in HydraConfig.get().overrides.task if o.split("=")[0] not in _OWN]
    own = compose_fitting("eval", [*shared, *spare.settings(), f"agent={row}"])
    for name in cfg.sounds:
        if name not in own.sound:
            raise UserError(f"sounds: '{name}' is none of {', '.join(own.sound)}")
    if cfg.sounds:
        own.sound = {name: own.sound[name] for name in cfg.sounds}
    return own
