"""World of results in words, for the headings of tables, pages and figures."""

from __future__ import annotations

from collections.abc import Iterable

# Characters of names above which sounds are counted.
_LONGEST = 120
TRIAL_SPLIT = "mini"
TRIAL_NOTE = (
    "mini is for trying the software: networks learn next to nothing in it, and its figures mean "
    "nothing"
)


def trial_note(splits: Iterable[str]) -> str:
    """Return the warning about results of `split=mini`; empty for other splits.

    Parameters
    ----------
    splits : iterable of str
        Names of the splits in which a run was evaluated and its networks were trained.
    """
    return TRIAL_NOTE if TRIAL_SPLIT in splits else ""


def sounds_text(sounds: Iterable[str], trained: Iterable[str] | None) -> str:
    """Describe sounds and whether the networks were trained with them; many are counted.

    Parameters
    ----------
    sounds : iterable of str
        Names of the sounds.
    trained : iterable of str, optional
        Those that are in the training; None if no network of the agent is trained on sounds.
    """
    names = list(sounds)
    if trained is None:
        return _listed(names)
    known = set(trained)
    heard = [name for name in names if name in known]
    unheard = [name for name in names if name not in known]
    parts = [("heard in training", heard), ("not heard in training", unheard)]
    return "; ".join(f"{_listed(own)} ({word})" for word, own in parts if own)


def _listed(names: list[str]) -> str:
    text = ", ".join(names)
    return f"sounds {text}" if len(text) <= _LONGEST else f"{len(names)} sounds"
