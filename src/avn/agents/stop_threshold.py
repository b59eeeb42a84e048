"""Probability from which agents stop, which falls as an episode goes on."""

from __future__ import annotations

from avn.core.errors import UserError


def check_half_life(half_life: float | None) -> None:
    """Raise a `UserError` if actions after which the threshold has halved are not more than 0."""
    if half_life is not None and not half_life > 0:
        raise UserError(f"planner.stop_half_life: {half_life}; give actions, more than 0, or null")


def stop_threshold(above: float, half_life: float | None, actions: int) -> float:
    """Return the probability from which an agent stops after a number of actions.

    Parameters
    ----------
    above : float
        Probability at the start.
    half_life : float or None
        Actions after which it has halved; None if it stays.
    actions : int
        Actions of the episode so far.
    """
    return above if half_life is None else above * 0.5 ** (actions / half_life)
