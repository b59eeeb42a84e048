"""What makes Hydra answer as the README says.

Beyond `hydra.main`: `-m` anywhere on the line, list keys without brackets, a path to an audio
file as an option of the group `sound`, keys checked even behind `+`, sweeps that name what
failed, and every mistake of the user's as one line and exit code 2.
"""

from __future__ import annotations

import dataclasses
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import hydra
import yaml
from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from avn import config, sound_files, sweeps
from avn.errors import UserError

LIST_KEYS = ("rows", "seeds", "apartments")
USER_MISTAKES = (UserError, HydraException, OmegaConfBaseException, yaml.YAMLError)


def conf_folder() -> Path:
    """The folder of configs: beside the package in a wheel, at the top of a checkout."""
    packaged = Path(__file__).parent / "conf"
    return packaged if packaged.is_dir() else Path(__file__).parents[2] / "conf"


def command(config_name: str) -> Callable[[Callable[[DictConfig], Path | None]], Callable[[], int]]:
    """Make a command of a function that takes the composed config.

    The command returns the exit code: 0, 1 for a fault of ours, 2 for a mistake of the
    user's, 130 when interrupted.
    """

    def decorate(task: Callable[[DictConfig], Path | None]) -> Callable[[], int]:
        def main() -> int:
            return _run(config_name, task)

        return main

    return decorate


def _run(config_name: str, task: Callable[[DictConfig], Path | None]) -> int:
    config.register()
    _register_plugins()
    name = f"avn.{config_name}"
    sys.argv = [sys.argv[0], *arrange(sys.argv[1:])]
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra then raises what it would print itself
    state = {"composed": False}

    def job(cfg: DictConfig) -> None:
        check_keys(cfg)
        state["composed"] = True
        if HydraConfig.get().mode == RunMode.MULTIRUN:
            sweeps.run_job(task, cfg, explain)
        else:
            task(cfg)

    job.__module__ = name
    is_sweep = "--multirun" in sys.argv
    try:
        if is_sweep:
            sweeps.begin()
        hydra.main(version_base="1.3", config_path=str(conf_folder()), config_name=config_name)(
            job
        )()
        return sweeps.end(name) if is_sweep else 0
    except KeyboardInterrupt:
        print(f"{name}: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        line = explain(error, composed=state["composed"])
        if line is None:
            traceback.print_exc()
            return 1
        print(f"{name}: {line}", file=sys.stderr)
        return 2


def arrange(arguments: Iterable[str]) -> list[str]:
    """Put the command line into the form that Hydra's parser takes.

    `-m` comes first wherever it stood, declared list keys get their brackets, and the paths
    of audio files their quotes.
    """
    sweep, rest = [], []
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if argument in ("-m", "--multirun"):
            sweep = ["--multirun"]
        elif equals and key in LIST_KEYS and not value.startswith("["):
            rest.append(f"{key}=[{value}]")
        elif equals and key == "sound":
            rest.append(f"sound={sound_files.quoted(value)}")
        else:
            rest.append(argument)
    return sweep + rest


def check_keys(cfg: DictConfig, path: str = "") -> None:
    """Refuse keys that no schema declares, which `+key=` and open nodes would let through.

    Raises
    ------
    UserError
        Naming the key and those that there are.
    """
    schema = OmegaConf.get_type(cfg)
    if dataclasses.is_dataclass(schema):
        known = [field.name for field in dataclasses.fields(schema)]
        for key in cfg:
            if key not in known:
                raise UserError(f"{path}{key}: no such key; there are {', '.join(known)}")
    for key in cfg:
        if not OmegaConf.is_missing(cfg, key) and isinstance(node := cfg._get_node(key), DictConfig):
            if node._is_none():
                continue
            check_keys(node, f"{path}{key}.")


def explain(error: BaseException, composed: bool = True) -> str | None:
    """One line for a mistake of the user's; None where the fault is ours.

    What goes wrong before the job starts comes of the command line or of a config file, so
    there every exception counts as the user's.
    """
    chain = [error]
    while (cause := chain[-1].__cause__ or chain[-1].__context__) and cause not in chain:
        chain.append(cause)
    for link in chain:
        if isinstance(link, UserError):
            return _one_line(str(link))
    for link in chain:
        if isinstance(link, OSError) and link.filename and not isinstance(link, HydraException):
            return _one_line(f"{link.filename}: {link.strerror}")
    if not composed or isinstance(error, USER_MISTAKES):
        texts = dict.fromkeys(_one_line(str(link)) for link in chain if str(link))
        return "; ".join(texts)
    return None


def _one_line(text: str) -> str:
    text = text.split("Config search path:")[0]
    text = re.sub(r"\s+schema\b", "", text)  # the dataclasses stand among the options
    text = re.sub(r"\s*(full_key|object_type|reference_type)[:=]\s*\S*", "", text)
    return " ".join(text.split())


def _register_plugins() -> None:
    for plugin in (sound_files.AudioFiles, sound_files.AudioFilesPath):
        Plugins.instance().register(plugin)


def plain(cfg: Any) -> Any:
    """A config node as plain lists and dicts, resolved."""
    return OmegaConf.to_container(cfg, resolve=True)
