"""Default config of a run: its row and its options as the package defines them."""

from __future__ import annotations

from functools import lru_cache

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf

from avn.config import option_files, registry
from avn.config.folder import conf_folder

# Groups whose options a run names besides its row.
_GROUPS = ("split", "acoustics", "protocol")


def default_config(cfg: DictConfig) -> DictConfig:
    """Return the config of a run's row under its split, acoustics and protocol, all unchanged.

    Options are those of the package: a name that the package does not have is left at its default,
    so that a row or an option of the user differs from what is returned.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    """
    named = [(group, str(OmegaConf.select(cfg, f"{group}.name"))) for group in ("agent", *_GROUPS)]
    return _composed(
        tuple(
            f"{group}={name}"
            for group, name in named
            if (conf_folder() / group / f"{name}.yaml").is_file()
        )
    )


@lru_cache(maxsize=64)
def _composed(overrides: tuple[str, ...]) -> DictConfig:
    registry.register()
    running = GlobalHydra.instance().hydra  # of the command, with the user's config folders
    GlobalHydra.instance().clear()
    try:
        with (
            option_files.package_only(),
            initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"),
        ):
            return compose("eval", overrides=[*overrides])
    finally:
        GlobalHydra.instance().hydra = running
