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
