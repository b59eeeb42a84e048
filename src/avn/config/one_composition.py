"""One composition of a command's config, where Hydra makes two.

`hydra.main` composes the config to learn whether it is of one job or of a sweep (`hydra.mode`,
which an experiment may set), and composes it once more for the job. Here, the job gets the first.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.hydra import Hydra
from hydra.types import RunMode
from omegaconf import DictConfig

# What Hydra adds to the overrides of one job.
_ONE_JOB = "hydra.mode=RUN"


@contextmanager
def composed_once() -> Iterator[None]:
    """Let `hydra.main` compose the config of one job once in the block."""
    mode, load = Hydra.get_mode, ConfigLoaderImpl.load_configuration
    # The config of one job, or the error of composing it, until the job asks for it.
    found: dict[tuple[str | None, ...], DictConfig | Exception] = {}

    def get_mode(hydra: Hydra, config_name: str | None, overrides: list[str]) -> Any:
        job = (config_name, *overrides, _ONE_JOB)
        try:
            cfg = hydra.compose_config(config_name, overrides, RunMode.RUN)
        except Exception as error:  # a mistake, or a sweep, which Hydra composes otherwise
            found[job] = error
            return mode(hydra, config_name, overrides)
        if cfg.hydra.mode is None:
            cfg.hydra.mode = RunMode.RUN
            cfg.hydra.overrides.hydra.append(_ONE_JOB)
            found[job] = cfg
            return None
        return cfg.hydra.mode

    def load_configuration(
        loader: ConfigLoaderImpl,
        config_name: str | None,
        overrides: list[str],
        *given: Any,
        **options: Any,
    ) -> DictConfig:
        known = found.pop((config_name, *overrides), None)
        if isinstance(known, Exception):
            raise known
        return load(loader, config_name, overrides, *given, **options) if known is None else known

    changed: list[tuple[type, str, Any, Any]] = [
        (Hydra, "get_mode", get_mode, mode),
        (ConfigLoaderImpl, "load_configuration", load_configuration, load),
    ]
    for owner, name, ours, _ in changed:
        setattr(owner, name, ours)
    try:
        yield
    finally:
        for owner, name, _, theirs in changed:
            setattr(owner, name, theirs)
