"""Comparison of two agents, or two settings, over the same episodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from avn.reporting.bootstrap import DRAWS, LEVEL, MIN_GROUPS, Floats, estimate
from avn.reporting.nesting import NETWORK, nested
from avn.reporting.pairing import paired
from avn.reporting.results import METRICS

# Probability that a difference of the smallest size is found.
POWER = 0.8
# What McNemar's test takes for granted, beside each of its results.
INDEPENDENT = (
    "McNemar's test takes episodes as independent; those of one source and apartment are not, so "
    "its p is too small for new apartments, and the interval is the one to read"
)


@dataclass(frozen=True)
class McNemar:
    """Exact McNemar test of success.

    Attributes
    ----------
    only_one, only_other : int
        Number of episodes in which one side alone succeeds.
    p : float
        Two-sided p-value.
    """

    only_one: int
    only_other: int
    p: float


@dataclass(frozen=True)
class Comparison:
    """Paired differences between two sides, the first minus the second.

    Attributes
    ----------
    table : DataFrame
        A row for each metric: `metric`; `one` and `other`, means of both sides; `difference` with
        its 95 % interval `low`, `high`; `detectable`, the smallest difference that so many episodes
        and apartments would show with a power of 80 % at a level of 5 %, two-sided; `spread`, the
        standard deviation of the difference between networks, NaN for one network. Ends and
        `detectable` are NaN with too few apartments.
    mcnemar : McNemar or None
        Test of success; None where a side has several networks.
    episodes, scenes, networks : int
        Numbers of paired episodes (of each network), apartments and networks.
    over : str
        Levels that are resampled for the intervals, in words.
    """

    table: pd.DataFrame
    mcnemar: McNemar | None
    episodes: int
    scenes: int
    networks: int
    over: str


def compare(
    one: pd.DataFrame,
    other: pd.DataFrame,
    names: Sequence[str] = ("the first", "the second"),
    draws: int = DRAWS,
) -> Comparison:
    """Compare two sides over the same episodes, `one` minus `other`.

    Parameters
    ----------
    one, other : DataFrame
        Records of one agent and setting each, of any number of seeds. Those of several networks
        have a column `train_seed`.
    names : sequence of str
        Names of both sides, for messages.
    draws : int
        Bootstrap resamples.

    Raises
    ------
    UserError
        If the sides cannot be paired; see `avn.reporting.pairing.paired`.
    """
    first, second = paired(one, other, names)
    columns = list(METRICS.values())
    values = first[columns].to_numpy(np.float64) - second[columns].to_numpy(np.float64)
    differences = first.drop(columns=columns).assign(**dict(zip(columns, values.T, strict=True)))
    found = estimate(nested(differences, columns), draws=draws)
    means = [estimate(nested(side, columns), draws=0).mean for side in (first, second)]
    scenes = first["scene"].nunique()
    groups = scenes if scenes > 1 else first["source"].nunique()
    enough = groups >= MIN_GROUPS
    table = pd.DataFrame(
        {
            "metric": list(METRICS),
            "one": means[0],
            "other": means[1],
            "difference": found.mean,
            "low": found.low,
            "high": found.high,
            "detectable": detectable(found.error, found.df) if enough else np.nan,
            "spread": found.spread,
        }
    )
    return Comparison(
        table=table,
        mcnemar=mcnemar(first["success"], second["success"]) if found.networks == 1 else None,
        episodes=len(first) // first[NETWORK].nunique(),
        scenes=scenes,
        networks=found.networks,
        over=found.over,
    )


def mcnemar(one: pd.Series, other: pd.Series) -> McNemar:
    """Test with McNemar's exact test whether two sides succeed equally often.

    Parameters
    ----------
    one, other : (N,) Series
        Success of the same episodes, 0 or 1.
    """
    from statsmodels.stats.contingency_tables import mcnemar as exact  # slow to import

    first, second = one.to_numpy(bool), other.to_numpy(bool)
    only_one, only_other = int((first & ~second).sum()), int((~first & second).sum())
    both, neither = int((first & second).sum()), int((~first & ~second).sum())
    table = [[both, only_one], [only_other, neither]]
    p = float(exact(table, exact=True).pvalue) if only_one + only_other else 1.0
    return McNemar(only_one, only_other, p)


def detectable(error: Floats, df: Floats) -> Floats:
    """Compute the smallest true differences that a t-test shows with a power of 80 %.

    The minimum detectable effect (t_0.975 + t_0.8) s of Bloom, "Minimum Detectable Effects: A
    Simple Way to Report the Statistical Power of Experimental Designs", Evaluation Review 19, 1995,
    with quantiles of Student's distribution.

    Parameters
    ----------
    error : (M,) float64
        s, standard errors of the paired differences between apartments.
    df : (M,) float64
        Degrees of freedom of the errors.
    """
    from scipy.special import stdtrit  # not needed to show a finished run

    multiple = stdtrit(df, 0.5 + LEVEL / 2) + stdtrit(df, POWER)
    return np.asarray(multiple * error, dtype=np.float64)
