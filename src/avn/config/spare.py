"""Settings of the command line that the chosen options do not have.

`agent=greedy planner.collision_cost=9` sets something of a planner where there is none. Hydra
cannot compose that, so such settings are set aside. The command refuses them by name; the rows of
a table take those that their own options have.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from hydra import compose
from hydra.errors import ConfigCompositionException
from omegaconf import DictConfig

_UNKNOWN = re.compile(r"Could not override '([\w.]+)'")
# Of the command line that is being run.
_spare: list[str] = []


def begin() -> None:
    """Forget the settings of an earlier command line."""
    _spare.clear()


def settings() -> Sequence[str]:
    """What was set aside, as it was given."""
    return tuple(_spare)


def set_aside(arguments: list[str], error: BaseException, everything: bool) -> bool:
    """Move the setting that an error is about from the arguments to what is set aside.

    Parameters
    ----------
    arguments : list of str
        The command line, which loses the setting.
    error : BaseException
        What composing raised.
    everything : bool
        Whether a setting that a chosen option does not have is set aside as well; else those alone
        whose group is `none`.

    Returns
    -------
    bool
        Whether there was such a setting.
    """
    found = _told(arguments, error, everything)
    if found is None:
        return False
    arguments.remove(found)
    _spare.append(found)
    return True


def compose_fitting(command: str, overrides: Sequence[str]) -> DictConfig:
    """Compose a config with those overrides that its options have.

    Parameters
    ----------
    command : str
        The name of the config.
    overrides : sequence of str
        Settings of groups that the chosen options do not have are left out.
    """
    kept = list(overrides)
    while True:
        try:
            return compose(command, overrides=kept)
        except ConfigCompositionException as error:
            found = _told(kept, error, everything=True)
            if found is None:
                raise
            kept.remove(found)


def _told(arguments: Sequence[str], error: BaseException, everything: bool) -> str | None:
    """The argument whose setting an option does not have."""
    if (told := _UNKNOWN.search(str(error))) is None:
        return None
    from avn.config.schema import BASES  # imports torch, which help does without

    key, cause = told[1], str(error.__cause__ or error)
    group = key.split(".")[0]
    if group not in BASES or not (everything or f"'{BASES[group].__name__}'" in cause):
        return None
    return next((own for own in arguments if own.split("=")[0] == key), None)
