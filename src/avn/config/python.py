"""Configs composed from Python, for functions that take the overrides of a command line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig

from avn.config import option_files, registry
from avn.config.cli import arrange, check_keys, explain
from avn.config.folder import conf_folder
from avn.config.row_networks import with_row_networks
from avn.core import numerics
from avn.core.errors import UserError


@contextmanager
def composing() -> Iterator[None]:
    """Make `hydra.compose` read the configs of this package, also in a program that uses Hydra."""
    registry.register()
    outer = GlobalHydra.instance().hydra
    GlobalHydra.instance().clear()
    try:
        with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):
            yield
    finally:
        GlobalHydra.instance().hydra = outer  # Hydra may have replaced the instance


def compose_command(command: str, overrides: Sequence[str]) -> tuple[DictConfig, list[str]]:
    """Compose the config of a command from the arguments of its command line.

    Parameters
    ----------
    command : str
        Name of the command, such as "eval".
    overrides : sequence of str
        Arguments, such as `split=mini`; `--config-dir=FOLDER` is accepted too.

    Returns
    -------
    cfg : DictConfig
        The config.
    given : list of str
        Overrides in Hydra's form.

    Raises
    ------
    UserError
        If they cannot be composed, or a key does not exist.
    """
    if isinstance(overrides, str):
        raise UserError(f"overrides: '{overrides}' is one string; give a list, ['{overrides}']")
    try:
        given = arrange(option_files.take_folders([str(own) for own in overrides]))
        if "--multirun" in given:
            raise UserError("overrides: -m is of the command line alone; remove it")
        if command == "train":
            given = with_row_networks(given)
        with composing():
            cfg = compose(command, overrides=given)
        check_keys(cfg)
        numerics.require(cfg.numerics)
    except Exception as error:
        line = explain(error, composed=False)
        raise UserError(line or str(error)) from None
    return cfg, given
