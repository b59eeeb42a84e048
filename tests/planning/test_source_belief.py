import numpy as np
import pytest

from avn.core.errors import UserError
from avn.planning.settings import SourceErrorModel
from avn.planning.source_belief import SourceBelief

YES = np.array([True])


def search(source: str = "latest") -> SourceBelief:
    return SourceBelief(1, 21, source, SourceErrorModel())


def update(
    own: SourceBelief, position: tuple[int, int], source_estimate: tuple[float, float]
) -> None:
    mirror_image = (source_estimate[0], 2 * position[1] - source_estimate[1])
    own.update(np.array([position]), np.array([source_estimate]), np.array([mirror_image]), YES)


def test_the_target_is_the_node_nearest_to_what_was_heard_last() -> None:
    own, cost = search(), np.full((1, 21, 21), np.inf, dtype=np.float32)
    rng = np.random.default_rng(0)
    for _ in range(200):
        cost[0] = np.where(rng.random((21, 21)) < 0.1, 1.0, np.inf)
        source_estimate = tuple(rng.uniform(-3, 24, 2))
        update(own, (10, 10), source_estimate)
        x, y = own.targets(cost, YES)[0]
        rows, columns = np.nonzero(np.isfinite(cost[0]))
        best = np.hypot(columns - source_estimate[0], rows - source_estimate[1]).min()
        assert np.hypot(x - source_estimate[0], y - source_estimate[1]) == pytest.approx(best)


def test_where_it_searched_it_does_not_search_again_until_all_is_searched() -> None:
    own, cost = search(), np.full((1, 21, 21), np.inf, dtype=np.float32)
    cost[0, 10, 10:13] = 1.0
    update(own, (10, 10), (10.0, 10.0))
    own.rule_out(np.array([[10, 10]]), 1, YES)
    assert own.targets(cost, YES).tolist() == [[12, 10]]
    own.rule_out(np.array([[12, 10]]), 1, YES)
    assert own.targets(cost, YES).tolist() == [[10, 10]]
    assert own.targets(np.full_like(cost, np.inf), YES).tolist() == [[10, 10]]


def test_belief_finds_where_bearings_cross() -> None:
    # From two places the source is heard in the right direction at the wrong distance.
    own, cost = search("bayes"), np.ones((1, 21, 21), dtype=np.float32)
    update(own, (2, 2), (8.0, 8.0))
    update(own, (18, 2), (12.0, 8.0))
    x, y = own.targets(cost, YES)[0]
    assert abs(x - 10) <= 1
    assert abs(y - 8) <= 2


def test_belief_forgets_a_confusion_of_front_and_back() -> None:
    own, cost = search("bayes"), np.ones((1, 21, 21), dtype=np.float32)
    update(own, (10, 10), (10.0, 4.0))  # the source is in front, and was heard behind
    assert own.targets(cost, YES)[0, 1] < 10
    update(own, (10, 11), (10.0, 16.0))
    update(own, (10, 12), (10.0, 16.0))
    assert own.targets(cost, YES)[0].tolist() == [10, 16]


def test_settings_that_cannot_work_are_refused() -> None:
    with pytest.raises(
        UserError, match=r"planner.source_filter: 'oldest' is none of latest, bayes"
    ):
        search("oldest")
    with pytest.raises(UserError, match=r"planner.error.sigma_per_metre: -1"):
        SourceErrorModel(sigma_per_metre=-1)
