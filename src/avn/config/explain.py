"""One-line messages for mistakes of the user, from the errors of Hydra, OmegaConf and our own."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path

import yaml
from hydra.errors import HydraException, OverrideParseException
from omegaconf.errors import OmegaConfBaseException

from avn.config.audio_source import AUDIO_SUFFIXES, choices
from avn.config.folder import conf_folder
from avn.config.option_files import option_names
from avn.core.errors import UserError
from avn.core.files import write_failure

USER_MISTAKES = (UserError, HydraException, OmegaConfBaseException, yaml.YAMLError)
_AMBIGUOUS = re.compile(r"Ambiguous value for argument '(.*)' 1\. To use it as a list")
_UNKNOWN_OPTION = re.compile(
    r"(?:In '\w+': )?Could not (?:find|load) '(\w+)/(.*?)' Available options in '\1': (.*)"
)
_NO_GROUP = re.compile(r"Could not override '(\w+)'\. ?No match in the defaults list")
_NO_LIST = re.compile(r"Invalid value assigned: \w+ is not a ListConfig, list or tuple\.?")
_UNKNOWN_SOUND = re.compile(r"Could not (?:find|load) 'sound/(.*?)'")
# Keys of `avn.reproduce` that take options of groups of `avn.eval`.
_LISTS = {"agent": "rows", "condition": "conditions"}


def explain(error: BaseException, composed: bool = True) -> str | None:
    """Return a one-line message for a mistake of the user, None for an internal error.

    Errors before the job starts come from the command line or a config file, so every exception
    there counts as a mistake of the user.
    """
    chain = [error]
    while (cause := chain[-1].__cause__ or chain[-1].__context__) and cause not in chain:
        chain.append(cause)
    for link in chain:
        if isinstance(link, UserError):
            return _one_line(str(link))
        if isinstance(link, OverrideParseException):
            return f"{link.override}: cannot be read; put quotes round what Hydra reads as grammar"
    for link in chain:
        if isinstance(link, OSError) and link.filename and not isinstance(link, HydraException):
            # what is not there was to be made
            made = None if os.path.lexists(link.filename) else write_failure(link, "")
            return _one_line(made or f"{link.filename}: {link.strerror}")
    if line := write_failure(error, "outputs"):
        return _one_line(line)
    if not composed or isinstance(error, USER_MISTAKES):
        lines = (_one_line(str(link)) for link in chain if str(link))
        # OmegaConf leaves the name of a key out of some of its messages
        first, *causes = dict.fromkeys(_named(line) for line in lines if "$FULL_KEY" not in line)
        known = [_known(link) for link in chain if _known(link)][:1]
        if "Could not find 'split/" in first:
            known.append("for a folder of floor plans give split.folder=PATH split.name=NAME")
        if unknown := _UNKNOWN_SOUND.search(first):
            first, causes, known = _sound(unknown[1]), [], []
        parts = [first, *(cause for cause in causes[:1] if cause not in first), *known]
        return "; ".join([*(part.rstrip(".") for part in parts[:-1]), parts[-1]])
    return None


def _named(line: str) -> str:
    """Return a message of Hydra about a group in words that name the group and its options."""
    if found := _AMBIGUOUS.search(line):
        argument = found[1].replace("sound@training.sounds", "training.sounds")
        key = argument.partition("=")[0]
        if key != "sound" and (conf_folder() / key).is_dir():
            return f"{argument}: several values; add -m for a run with each"
        return (
            f"{argument}: several values; put brackets round a list or quotes round a text, or add "
            "-m for a run with each"
        )
    if (found := _UNKNOWN_OPTION.search(line)) and found[1] not in ("split", "sound"):
        return f"{found[1]}: there is no '{found[2]}'; there are {', '.join(found[3].split())}"
    if found := _NO_GROUP.search(line):
        instead = f"; avn.reproduce has {_LISTS[found[1]]}=" if found[1] in _LISTS else ""
        return f"{found[1]}: no group of this command{instead}"
    return _NO_LIST.sub("give a list, such as [0, 1]", line)


def _sound(option: str) -> str:
    """Return the message about an unknown option of the group `sound`."""
    if Path(option).expanduser().is_file():
        return f"sound: '{option}': its ending is none of {', '.join(AUDIO_SUFFIXES)}; rename it"
    known = ", ".join(option_names("sound"))
    return f"sound: there is no '{option}'; there are {known}, {choices(option)}"


def _known(error: BaseException) -> str:
    """Return the keys of a node as text if an error is about an unknown key."""
    schema = getattr(error, "object_type", None)
    if " not in '" not in str(error) or not dataclasses.is_dataclass(schema):
        return ""
    names = [field.name for field in dataclasses.fields(schema) if field.name != "_target_"]
    return f"there are {', '.join(names)}"


def _one_line(text: str) -> str:
    text = text.split("Config search path:")[0]
    text = re.sub(r"To append to your config use \S+", "", text)  # which is refused too
    text = re.sub(r"\s+\w*schema\b", "", text)  # the dataclasses stand among the options
    text = re.sub(r"\s*(full_key|object_type|reference_type)[:=]\s*\S*", "", text)
    return " ".join(text.split())
