"""The curve of a training of an actor-critic, and which of its networks is kept."""

from __future__ import annotations

from collections.abc import Sequence

# Validation metric that selects the best network.
MONITOR = "validation/spl"


def best_of(curve: Sequence[dict[str, float]]) -> dict[str, float]:
    """Return the entry of a curve whose network is kept.

    It is the best on validation of the networks that were trained, the latest of equal ones. The
    untrained network, the first entry, is the best only while it is alone: small validation
    apartments may rate it higher by chance.
    """
    return max(reversed(curve[1:] or curve), key=lambda point: point[MONITOR])
