"""Settings of the command line that do not exist in the selected options.

`agent=greedy planner.collision_cost=9` sets a key of a planner where there is none. Hydra cannot
compose that, so such settings are set aside. A command refuses them by name; in a table, each row
uses those that its options have.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from hydra import compose
from hydra.errors import ConfigCompositionException
from omegaconf import DictConfig

_UNKNOWN = re.compile(r"Could not override '([\w.]+)'")
# Settings of the current command line that were set aside.
_spare: list[str] = []


def begin() -> None:
    """Forget the settings of an earlier command line."""
    _spare.clear()


def settings() -> Sequence[str]:
    """Return the settings that were set aside, as given."""
    return tuple(_spare)


def set_aside(arguments: list[str], error: BaseException, everything: bool) -> bool:
    """Remove the setting that an error is about from the arguments and set it aside.

    Parameters
    ----------
    arguments : list of str
        Command line; the setting is removed in place.
    error : BaseException
        Error of composing the config.
    everything : bool
        Whether any setting that the selected option lacks is set aside; otherwise only settings
        of groups whose option is `none`.

    Returns
    -------
    bool
        Whether there was such a setting.
    """
    unknown = _unknown_setting(arguments, error, everything)
    if unknown is None:
        return False
    arguments.remove(unknown)
    _spare.append(unknown)
    return True


def compose_fitting(command: str, overrides: Sequence[str]) -> DictConfig:
    """Compose a config with those overrides that exist in its options.

    Parameters
    ----------
    command : str
        Name of the config.
    overrides : sequence of str
        Overrides; settings that the selected options lack are left out.
    """
    kept = list(overrides)
    while True:
        try:
            return compose(command, overrides=kept)
        except ConfigCompositionException as error:
            unknown = _unknown_setting(kept, error, everything=True)
            if unknown is None:
                raise
            kept.remove(unknown)


def _unknown_setting(
    arguments: Sequence[str], error: BaseException, everything: bool
) -> str | None:
    """Return the argument whose key the selected option lacks, None where there is none."""
    if (match := _UNKNOWN.search(str(error))) is None:
        return None
    from avn.config.schema import BASES  # imports torch, which help does not need

    key, cause = match[1], str(error.__cause__ or error)
    group = key.split(".")[0]
    if group not in BASES or not (everything or f"'{BASES[group].__name__}'" in cause):
        return None
    return next((given for given in arguments if given.split("=")[0] == key), None)
