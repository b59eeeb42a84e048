"""Entry point of the commands: Hydra with a more lenient syntax and one-line errors.

In addition to `hydra.main`: `-m` anywhere on the line, list keys without brackets, a path of an
audio file as an option of the group `sound`, keys checked even behind `+`, sweeps that name the
jobs that failed, and one line and exit code 2 for every mistake of the user.
"""

from __future__ import annotations

import dataclasses
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import ConfigCompositionException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from avn.config import renamed, spare
from avn.config.audio_source import name_files, quoted
from avn.config.explain import explain
from avn.config.folder import conf_folder, without_folders
from avn.config.help import help_text, is_asked
from avn.config.one_composition import composed_once
from avn.config.option_files import option_names
from avn.core import numerics
from avn.core.errors import UserError
from avn.core.signals import exit_code_of

# Groups of the training world, from their key to Hydra's spelling. Apartments and acoustics are
# those of the test world unless they are set.
TRAINING = {
    "training.scenes": "+split@training.scenes",
    "training.acoustics": "+acoustics@training.acoustics",
    "training.microphone": "microphone@training.microphone",
    "training.sounds": "sound@training.sounds",
}
# Flags of Hydra's parser, without those that `arrange` and `option_files` take.
_FLAGS = re.compile(
    r"-[cprih]+|--(cfg|package|resolve|run|info|hydra-help|version|shell-completion|config-path"
    r"|config-name|experimental-rerun)(=.*)?|-c[pn]"
)
# Groups of which several options can be chosen at once.
SEVERAL = ("logger", "callbacks")
LIST_KEYS = (
    *("rows", "conditions", "world", "sounds", "seeds", "train_seeds", "apartments"),
    *SEVERAL,
)
_SWEEP = ("-m", "--multirun")


def command(config_name: str) -> Callable[[Callable[[DictConfig], Path | None]], Callable[[], int]]:
    """Decorate a function of the composed config as a command.

    The command returns the exit code: 0, 1 for an internal error, 2 for a mistake of the user, and
    those of `avn.core.signals.exit_code_of`. `--help` is answered without composing a config.
    """

    def decorate(task: Callable[[DictConfig], Path | None]) -> Callable[[], int]:
        def main() -> int:
            if is_asked(sys.argv[1:]):
                return plainly(f"avn.{config_name}", lambda: _help(config_name))
            name = f"avn.{config_name}"
            return exit_code_of(name, lambda: _run(config_name, task))

        return main

    return decorate


def _help(config_name: str) -> None:
    _, folders = without_folders(sys.argv[1:])
    try:
        print(help_text(config_name, folders, TRAINING), flush=True)
    except BrokenPipeError:  # of `--help | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(config_name: str, task: Callable[[DictConfig], Path | None]) -> int:
    # The schemas import torch and sweeps pandas. Help is answered before and needs neither; for the
    # same reason each command imports from `pipeline/` where it needs it.
    from avn.config import option_files, registry, sweeps
    from avn.config.row_networks import with_row_networks

    registry.register()
    name = f"avn.{config_name}"
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra then raises what it would print itself
    errors: list[Exception] = []

    def job(cfg: DictConfig) -> None:
        if HydraConfig.get().mode == RunMode.MULTIRUN:
            sweeps.run_job(checked, cfg, explain)
            return
        try:
            checked(cfg)
        except Exception as error:  # hidden from Hydra, which would print its own lines
            errors.append(error)

    def checked(cfg: DictConfig) -> Path | None:
        name_files(cfg)
        check_keys(cfg)
        numerics.use(cfg.numerics, sweeps.forget)
        return task(cfg)

    job.__module__ = name
    try:
        sweeps.begin()  # of one job or of many: an experiment may be a sweep by itself
        arguments = arrange(option_files.take_folders(sys.argv[1:]))
        if config_name == "train":
            arguments = with_row_networks(arguments)
        sys.argv = [sys.argv[0], *arguments]
        _compose_and_do(config_name, job)
        if errors:
            return _report(name, errors[0], explain(errors[0]))
        return sweeps.end(name)
    except Exception as error:
        return _report(name, error, explain(error, composed=False))
    finally:
        sweeps.forget()


def _compose_and_do(config_name: str, job: Callable[[DictConfig], None]) -> None:
    """Let Hydra compose the config and run the job; set unknown settings of options aside."""
    spare.begin()
    composed = hydra.main(
        version_base="1.3", config_path=str(conf_folder()), config_name=config_name
    )(job)
    while True:
        try:
            with composed_once():
                composed()
            return
        except ConfigCompositionException as error:
            if not spare.set_aside(sys.argv, error, everything=config_name == "reproduce"):
                raise


def plainly(name: str, task: Callable[[], None]) -> int:
    """Run a command without a Hydra config; the exit codes are those of `command`."""

    def run() -> int:
        try:
            task()
        except Exception as error:
            return _report(name, error, explain(error))
        return 0

    return exit_code_of(name, run)


def _report(name: str, error: Exception, line: str | None) -> int:
    if line is None:
        traceback.print_exception(error)
        return 1
    print(f"{name}: {line}", file=sys.stderr)
    return 2


def arrange(arguments: Iterable[str]) -> list[str]:
    """Convert the command line to the form that Hydra's parser takes.

    `-m` is moved to the front, list keys get brackets, and paths of audio files get quotes.

    Raises
    ------
    UserError
        Where a group is given no option, or an option its former name.
    """
    sweep, rest = [], []
    groups = _groups()
    for argument in arguments:
        check_text(argument)
        key, equals, value = argument.partition("=")
        if argument.startswith("-") and not _FLAGS.fullmatch(argument) and argument not in _SWEEP:
            raise UserError(
                f"{argument}: no such flag; there are --help, -m, --config-dir FOLDER and --cfg "
                "job, and settings are given as KEY=VALUE"
            )
        renamed.check_name(key.lstrip("+~"))
        if key in groups and equals and (value in ("", "null") or value.endswith("schema")):
            raise UserError(f"{argument}: name an option; there are {groups[key]}")
        if key == "condition" and value.startswith("["):
            raise UserError(
                f"{argument}: a list; name one condition, to which settings can be added, "
                "such as condition=silence odometry=noisy"
            )
        if key in SEVERAL and equals:
            _check_options(argument, key, value)
        if argument in _SWEEP:
            sweep = ["--multirun"]
        elif equals and key in LIST_KEYS and not value.startswith("["):
            rest.append(f"{key}=[{value}]")
        elif equals and key in ("sound", "training.sounds"):
            rest.append(f"{TRAINING.get(key, key)}={quoted(value)}")
        elif equals and key in TRAINING:
            rest.append(f"{TRAINING[key]}={value}")
        else:
            rest.append(argument)
    _check_training(rest)
    return sweep + rest


def _check_options(argument: str, group: str, value: str) -> None:
    """Refuse an option that does not exist; Hydra's own message of a list names no others."""
    known = option_names(group)
    for name in value.strip("[]").replace(" ", "").split(","):
        if name and name not in known:
            raise UserError(
                f"{argument}: there is no '{name}' in {group}; there are {', '.join(known)}"
            )


def check_text(argument: str) -> None:
    """Refuse an argument that is no text, such as a file's name that is not encoded as UTF-8."""
    try:
        argument.encode()
    except UnicodeEncodeError:
        shown = os.fsencode(argument).decode("utf-8", "backslashreplace")
        raise UserError(f"{shown}: not valid UTF-8; rename the file or folder") from None


def _check_training(arguments: list[str]) -> None:
    """Refuse a setting of the training world that would change the test world too."""
    for name in ("scenes", "acoustics"):
        key = f"training.{name}"
        for argument in arguments:
            follows = not any(given.startswith(f"{TRAINING[key]}=") for given in arguments)
            if argument.startswith(f"{key}.") and follows:
                raise UserError(
                    f"{argument}: the training world follows the test world here; choose its "
                    f"own first, such as {key}={'var' if name == 'scenes' else 'resonance'}"
                )


def _groups() -> dict[str, str]:
    """Return the config groups, each with a list of its options as text."""
    folders = [folder for folder in sorted(conf_folder().iterdir()) if folder.is_dir()]
    return {f.name: ", ".join(sorted(file.stem for file in f.glob("*.yaml"))) for f in folders}


def check_keys(cfg: DictConfig, path: str = "") -> None:
    """Refuse keys that no schema declares, which `+key=` and open nodes would let through.

    Raises
    ------
    UserError
        For an unknown key; the message lists the known ones.
    """
    schema = OmegaConf.get_type(cfg)
    if dataclasses.is_dataclass(schema):
        known = [field.name for field in dataclasses.fields(schema)]
        for key in map(str, cfg):
            if key not in known:
                raise UserError(f"{path}{key}: no such key; there are {', '.join(known)}")
    for key in map(str, cfg):
        node = None if OmegaConf.is_missing(cfg, key) else cfg[key]
        if isinstance(node, DictConfig):
            check_keys(node, f"{path}{key}.")
