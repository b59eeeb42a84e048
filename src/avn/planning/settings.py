"""Settings of planning; importing them needs no numerical library."""

from __future__ import annotations

from dataclasses import dataclass

from avn.core.errors import UserError


@dataclass
class SourceErrorModel:
    """Error model of the source estimates, for `source_filter=bayes`.

    The likelihood of an estimate r metres away is a Gaussian with the standard deviation
    `sigma` + `sigma_per_metre` r, its mirror image behind the agent with the weight
    `front_back_prob`, for confusions of front and back, and the constant `outlier_prob`.

    Attributes
    ----------
    sigma : float
        Standard deviation at distance 0, metres, more than 0 and up to 100.
    sigma_per_metre : float
        Increase of the standard deviation for each metre of distance, 0 to 100.
    front_back_prob : float
        Weight of the mirror image behind the agent, 0 or more and below 1.
    outlier_prob : float
        Constant part of the likelihood, for outliers, more than 0 and up to 100.
    weight : float
        Factor of the log-likelihood of each estimate, 0 to 100; below 1 because the errors of
        nearby estimates are correlated.

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    sigma: float = 0.5
    sigma_per_metre: float = 0.25
    front_back_prob: float = 0.1
    outlier_prob: float = 0.02
    weight: float = 0.5

    def __post_init__(self) -> None:
        """Check the settings."""
        for key in ("sigma", "sigma_per_metre", "front_back_prob", "outlier_prob", "weight"):
            if not 0 <= getattr(self, key) <= 100:
                raise UserError(f"planner.error.{key}: {getattr(self, key)}; give 0 to 100")
        if self.sigma == 0 or self.outlier_prob == 0 or self.front_back_prob >= 1:
            raise UserError(
                "planner.error: sigma and outlier_prob are over 0, and front_back_prob is under 1"
            )


@dataclass
class ArrivalModel:
    """Weights of what is heard, for `planner=belief`.

    The log-posterior of a square is a sum over the last `places` squares at which the agent was. Of
    each, it has the log-probability of the direction in which the shortest path to the square
    leaves, and a Gaussian of the logarithm of the length of this path.

    Attributes
    ----------
    places : int
        Squares walked whose evidence is kept, 1 to 50.
    kept : float
        Share of the weight of evidence that is kept, 0 to 1, by `forget_by`.
    forget_by : {"square", "information"}
        "square" keeps the share `kept` with each square walked. "information" keeps `kept` to the
        power of what the first clip heard on the new square tells about the direction of arrival,
        in nats: log(B) less the entropy over B directions. Evidence then lasts in noise, and what
        is heard clearly replaces it.
    bearing_weight, distance_weight : float
        Factors of the two terms, 0 to 100; below 1 because errors of nearby places are correlated.
    shared_by_headings : float or None
        Part of the evidence about the direction that the headings of a square share, 0 to 1: k
        headings count as k to the power of 1 - this, so at 1 as their mean. None is 0 with
        `look=once` and 1 with `look=around`, where all squares have four.
    blur : float
        Share of a uniform distribution in that of the direction, more than 0 and below 1.
    least_sigma : float
        Least standard deviation of the log-length, more than 0 and up to 10.
    bias : float
        Standard deviation of an error that the log-lengths of all places share, 0 to 10. Above 0 it
        is integrated out, so that a source of unknown loudness is placed by how lengths change
        along the way.
    reach : int
        Length up to which paths are followed, in squares, 1 to 1000.
    tail : float
        Share of the posterior that may be neglected for speed, 0 to 0.5. Squares are scored up to a
        length of the path from the newest place: that beyond which less than this share lay in the
        step before, a quarter more, and 3 squares. It doubles where the posterior reaches it. At 0,
        all squares within `reach` are scored.

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    places: int = 6
    kept: float = 0.7
    forget_by: str = "square"
    bearing_weight: float = 1.0
    distance_weight: float = 1.0
    shared_by_headings: float | None = None
    blur: float = 0.1
    least_sigma: float = 0.1
    bias: float = 0.0
    reach: int = 60
    tail: float = 0.0

    def __post_init__(self) -> None:
        """Check the settings."""
        limits = {
            "places": (1, 50),
            "kept": (0, 1),
            "bearing_weight": (0, 100),
            "distance_weight": (0, 100),
            "shared_by_headings": (0, 1),
            "blur": (1e-6, 0.999),
            "least_sigma": (1e-3, 10),
            "bias": (0, 10),
            "reach": (1, 1000),
            "tail": (0, 0.5),
        }
        for key, (least, most) in limits.items():
            value = getattr(self, key)
            if value is not None and not least <= value <= most:
                raise UserError(f"planner.model.{key}: {value}; give {least} to {most}")
        if self.forget_by not in ("square", "information"):
            raise UserError(
                f"planner.model.forget_by: {self.forget_by}; give square or information"
            )
