"""Times at which sounds begin and end follow their distributions."""

import numpy as np
import pytest
from scipy import stats

from avn.core.errors import UserError
from avn.core.random import derive, scramble
from avn.navigation.schedule import Schedule

KEYS = scramble(derive("test"), np.arange(20_000))


def test_beginnings_are_uniform_and_durations_normal_down_to_the_least():
    begin, end = (own.numpy() for own in Schedule().draw(KEYS))
    assert stats.kstest(begin, stats.uniform(0, 5).cdf).pvalue > 0.01
    duration = end - begin
    shortest = duration < 1 + 1e-9
    assert abs(shortest.mean() - stats.norm(15, 9).cdf(1)) < 0.01
    truncated = stats.truncnorm((1 - 15) / 9, np.inf, 15, 9)
    assert stats.kstest(duration[~shortest], truncated.cdf).pvalue > 0.01
    assert abs(np.corrcoef(begin, duration)[0, 1]) < 0.02


def test_the_times_of_an_episode_do_not_depend_on_the_others():
    whole, part = Schedule().draw(KEYS), Schedule().draw(KEYS[5:9])
    for one, other in zip(whole, part, strict=True):
        assert one[5:9].tolist() == other.tolist()


def test_one_time_for_all():
    begin, end = Schedule((2, 2), 4, 0).draw(KEYS[:3])
    assert begin.tolist() == [2.0] * 3
    assert end.tolist() == [6.0] * 3


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"begins": (5, 0)}, "schedule.begins"),
        ({"begins": (-1, 0)}, "schedule.begins"),
        ({"begins": (0, 1, 2)}, "schedule.begins"),
        ({"begins": (0, float("inf"))}, "schedule.begins"),
        ({"mean": float("nan")}, "schedule.mean"),
        ({"deviation": -1}, "schedule.deviation"),
        ({"least": 0}, "schedule.least"),
    ],
)
def test_a_mistake_names_its_key(options, key):
    with pytest.raises(UserError, match=key):
        Schedule(**options)
