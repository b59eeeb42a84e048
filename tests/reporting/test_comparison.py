"""Comparison of two agents over the same episodes."""

import numpy as np
import pandas as pd
import pytest
from made_runs import records
from scipy import stats

from avn.core.errors import UserError
from avn.reporting.bootstrap import Nested, estimate
from avn.reporting.comparison import compare, detectable, mcnemar
from avn.reporting.comparison_table import NAMES
from avn.reporting.pairing import paired
from avn.reporting.results import METRICS


def rows(found):
    return found.table.set_index("metric")


def test_differences_are_those_of_the_apartments():
    one, other = records("one", starts=[2, 3, 4, 5, 6]), records("two", starts=[2, 3, 4, 5, 6])
    found = compare(one, other)
    for metric, column in (("sr", "success"), ("spl", "spl"), ("dtg", "dtg")):
        scenes = (one[column] - other[column]).groupby(one["scene"]).mean()  # of equal weight
        row = rows(found).loc[metric]
        assert row["difference"] == pytest.approx(scenes.mean())
        assert row["one"] - row["other"] == pytest.approx(row["difference"])
        assert row["low"] < row["difference"] < row["high"]
        power = stats.t.ppf(0.975, 4) + stats.t.ppf(0.8, 4)
        assert row["detectable"] == pytest.approx(power * stats.sem(scenes))
    assert (found.episodes, found.scenes, found.networks) == (len(one), 5, 1)
    assert found.over == "apartments, sources and episodes"


def test_equal_runs_differ_by_nothing():
    found = compare(records(), records())
    zeros = rows(found)[["difference", "low", "high", "detectable"]]
    assert (zeros == 0).all(axis=None)
    assert found.mcnemar is not None
    assert found.mcnemar.p == 1.0


def test_a_constant_gain_is_known_exactly():
    one = records()
    found = rows(compare(one.assign(dtg=one["dtg"] - 0.5), one)).loc["dtg"]
    assert found[["difference", "low", "high"]].tolist() == pytest.approx([-0.5] * 3)
    assert found["detectable"] == pytest.approx(0.0, abs=1e-12)


def test_the_order_of_the_rows_does_not_count():
    one, other = records("one"), records("two")
    found = compare(one, other)
    again = compare(one.sample(frac=1, random_state=0), other.sample(frac=1, random_state=1))
    pd.testing.assert_frame_equal(again.table, found.table, check_exact=True)
    assert again.mcnemar == found.mcnemar


def test_sides_exchanged_have_the_opposite_difference():
    one, other = records("one"), records("two")
    there, back = rows(compare(one, other)), rows(compare(other, one))
    assert there["difference"].tolist() == pytest.approx((-back["difference"]).tolist())
    assert there["low"].tolist() == pytest.approx((-back["high"]).tolist())
    assert there["detectable"].tolist() == pytest.approx(back["detectable"].tolist())


def test_mcnemar_is_the_sign_test_of_what_one_alone_solves():
    rng = np.random.default_rng(0)
    one, other = (pd.Series(rng.random(60) < rate).astype(int) for rate in (0.7, 0.5))
    found = mcnemar(one, other)
    only = int(((one == 1) & (other == 0)).sum()), int(((one == 0) & (other == 1)).sum())
    assert (found.only_one, found.only_other) == only
    assert found.p == pytest.approx(stats.binomtest(only[0], sum(only)).pvalue)


def test_few_apartments_have_a_difference_without_interval():
    few = compare(records("one", scenes=3), records("two", scenes=3))
    assert rows(few)[["low", "high", "detectable"]].isna().all(axis=None)
    assert rows(few)["difference"].notna().all()


def test_every_metric_has_a_name():
    assert set(NAMES) == set(METRICS)


def test_one_apartment_speaks_of_itself():
    one = compare(records("one", scenes=1), records("two", scenes=1))
    assert one.over == "sources and episodes of this apartment"
    assert (rows(one)["low"] < rows(one)["high"]).all()
    assert rows(one)["detectable"].notna().all()


def networks(agent, seeds=(0, 1, 2), rate=0.5):
    parts = [records(agent, draw=seed, rate=rate).assign(train_seed=seed) for seed in seeds]
    return pd.concat(parts, ignore_index=True)


def test_networks_are_paired_by_their_seed_and_averaged():
    one, other = networks("one"), networks("two")
    found = compare(one, other)
    each = [
        rows(compare(one[one["train_seed"] == n], other[other["train_seed"] == n]))["difference"]
        for n in range(3)
    ]
    assert found.networks == 3
    assert found.over.startswith("networks, apartments")
    assert found.mcnemar is None
    assert rows(found)["difference"].tolist() == pytest.approx(np.mean(each, axis=0).tolist())
    assert rows(found)["spread"].tolist() == pytest.approx(np.std(each, axis=0, ddof=1).tolist())
    assert found.episodes == len(one) // 3


def test_a_side_without_networks_of_its_own_is_compared_with_each_network():
    found = compare(networks("one"), records("two"))
    assert found.networks == 3
    mean = networks("one").groupby(["scene"])["success"].mean()
    other = records("two").groupby("scene")["success"].mean()
    assert rows(found).loc["sr", "difference"] == pytest.approx((mean - other).mean())


def test_other_networks_are_refused():
    with pytest.raises(UserError, match=r"train_seed: 0, 1 of a and 0, 2 of b"):
        paired(networks("one", (0, 1)), networks("two", (0, 2)), ("a", "b"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"protocol": "stop"}, r"different protocols \(var and stop\)"),
        ({"source_cell": 7}, "different source positions"),
        ({"start_heading": 9}, "different starts"),
        ({"geodesic": 1.0}, "different floor plans"),
        ({"seed": 1}, "seeds differ: 0 of a and 1 of b"),
        ({"scene": "room_9"}, "apartments differ: room_1, room_2, room_3, room_4, room_5 of a"),
        ({"sound": "clock"}, "sounds differ: alarm, ring of a and clock of b"),
    ],
)
def test_what_keeps_runs_from_being_paired_is_named(change, said):
    with pytest.raises(UserError, match=said):
        compare(records("one"), records("two").assign(**change), ("a", "b"))


def test_missing_and_repeated_episodes_are_refused():
    one, other = records("one"), records("two")
    with pytest.raises(UserError, match="a and b walked different episodes"):
        compare(one, other.drop(index=3), ("a", "b"))
    with pytest.raises(UserError, match="b has an episode twice"):
        compare(one, pd.concat([other, other.iloc[:1]]), ("a", "b"))
    with pytest.raises(UserError, match="episodes differ: 20 of a and 15 of b"):
        compare(one, records("two", starts=3), ("a", "b"))


@pytest.mark.parametrize("scenes", [5, 10, 20])
def test_the_smallest_difference_is_shown_four_times_out_of_five(scenes):
    rng = np.random.default_rng(scenes)
    # apartments vary by 1 with what varies below them, so that the error is known
    count, sources, starts = 4000, 3, 2
    shape = (scenes, sources, starts, 1, count)
    noise = rng.normal(0, np.sqrt(0.5 * sources * starts), shape)
    values = rng.normal(0, np.sqrt(0.5), (scenes, 1, 1, 1, count)) + noise
    error, df = np.array([1 / np.sqrt(scenes)]), np.array([scenes - 1.0])
    values += detectable(error, df)
    source = np.repeat(np.arange(scenes * sources), starts)
    nested = Nested(
        values.reshape(-1, 1, count),
        np.ones(len(source)),
        source,
        np.repeat(np.arange(scenes), sources),
    )
    found = estimate(nested, draws=0)
    shown = np.abs(found.mean) > stats.t.ppf(0.975, scenes - 1) * found.error
    assert 0.77 < shown.mean() < 0.83
