import math

import numpy as np
import pytest

from avn.core.errors import UserError
from avn.planning.arrival_belief import ArrivalBelief
from avn.planning.settings import ArrivalModel
from avn.planning.sound_fields import SQUARES, sound_fields

BINS, SIZE = 72, 41
ALL = np.array([True])


def rooms():
    """Two rooms with a door between them; the agent's map knows them."""
    cost = np.full((1, SIZE, SIZE), np.inf, np.float32)
    cost[0, 10:20, 10:30] = cost[0, 21:31, 10:30] = 1
    cost[0, 20, 27] = 1
    return cost


def heard(cost, pose, source, sigma=0.1):
    """Bearing and distance that arrive at a pose from a source, exact within a bin."""
    length, direction = np.empty((1, *cost.shape), np.int16), np.empty((1, *cost.shape), np.uint8)
    only = np.zeros(1, np.int64)
    sound_fields(cost, np.array([[pose[:2]]]), only, only, 100, BINS, length, direction)
    there = (0, 0, source[1], source[0])
    bearing = np.full((1, BINS), math.log(0.01 / BINS), np.float32)
    local = (int(direction[there]) - pose[2] * BINS // 4) % BINS
    bearing[0, local] = math.log(0.99)
    squares = length[there] * SQUARES
    return bearing, np.array([[math.log(squares), sigma]], np.float32)


def walk(cost, poses, source, model=None, **more):
    belief = ArrivalBelief(1, SIZE, BINS, model or ArrivalModel())
    for pose in poses:
        belief.hear(np.array([pose]), *heard(cost, pose, source, **more), ALL)
    belief.score(cost, ALL)
    return belief


@pytest.mark.parametrize("heading", range(4))
def test_one_place_finds_a_source_in_sight(heading):
    found = walk(rooms(), [(12, 12, heading)], (20, 17)).targets(rooms(), ALL)[0]
    assert np.abs(found - (20, 17)).max() <= 1


def test_a_source_behind_a_wall_is_looked_for_through_the_door():
    source = (12, 28)
    belief = walk(rooms(), [(12, 12, 0), (13, 12, 1), (14, 12, 1)], source)
    x, y = belief.targets(rooms(), ALL)[0]
    assert y > 20, "beyond the wall"
    # without the wall the same evidence points into the near room or beyond its right side
    free = np.ones_like(rooms())
    belief.score(free, ALL)
    x, y = belief.targets(free, ALL)[0]
    assert x > 27


def test_a_source_behind_furniture_is_heard_over_it():
    # a table across a room, around which the agent walks at the right side
    sound = np.ones((1, SIZE, SIZE), np.float32)
    walkable = sound.copy()
    walkable[0, 16, :30] = np.inf
    source, poses = (12, 22), [(10, 10, 0), (11, 10, 1), (12, 10, 1)]
    belief = ArrivalBelief(1, SIZE, BINS, ArrivalModel())
    for pose in poses:
        belief.hear(np.array([pose]), *heard(sound, pose, source), ALL)
    belief.score(walkable, ALL, sound)
    found = belief.targets(walkable, ALL, sound_cost=sound)[0]
    assert np.abs(found - source).max() <= 1
    assert belief.log_belief[0, 16, 12] == -np.inf, "a source stands where the agent can go"
    # on the map of the agent the same evidence is of this side of the table
    belief.score(walkable, ALL)
    assert belief.targets(walkable, ALL)[0][1] < 16


@pytest.mark.parametrize("shared", [0.0, 1.0])
def test_a_source_is_found_where_the_agent_stands(shared):
    # sound that comes from all directions alike is of the square itself as much as of any other
    source, model = (14, 12), ArrivalModel(shared_by_headings=shared)
    belief, one = ArrivalBelief(1, SIZE, BINS, model), walk(rooms(), [(13, 12, 1)], source, model)
    nowhere = np.full((1, BINS), -math.log(BINS), np.float32)
    for heading in range(4):
        pose = np.array([(*source, heading)])
        belief.hear(pose, nowhere, np.float32([[0, 50]]), ALL)
        one.hear(pose, nowhere, np.float32([[0, 50]]), ALL)
    belief.score(rooms(), ALL)
    one.score(rooms(), ALL)
    np.testing.assert_allclose(
        belief.log_belief[0, 10:20, 10:30], belief.log_belief[0, 12, 14], rtol=1e-3
    )
    assert tuple(one.targets(rooms(), ALL)[0]) == source
    # where it heard the sound from one direction, the source is not: here beyond the wall instead
    away = walk(rooms(), [(12, 12, 1)], (20, 12), model).log_belief[0]
    assert away[12, 12] < away[12, 13:28].max() - 3


def test_two_bearings_cross_at_the_source():
    model = ArrivalModel(distance_weight=0, kept=1)
    source, cost = (25, 18), np.ones((1, SIZE, SIZE), np.float32)
    found = walk(cost, [(10, 10, 0), (25, 10, 0)], source, model).targets(cost, ALL)[0]
    assert np.abs(found - source)[0] <= 1
    assert abs(found[1] - 18) <= 2


def test_headings_that_share_their_errors_count_as_their_mean():
    source, here = (20, 17), (12, 12)
    turned = [(*here, heading) for heading in range(4)]
    one = walk(rooms(), turned[:1], source, ArrivalModel(shared_by_headings=1)).log_belief
    mean = walk(rooms(), turned, source, ArrivalModel(shared_by_headings=1)).log_belief
    half = walk(rooms(), turned, source, ArrivalModel(shared_by_headings=0.5)).log_belief
    whole = walk(rooms(), turned, source, ArrivalModel(shared_by_headings=0)).log_belief
    plain = walk(rooms(), turned, source, ArrivalModel()).log_belief
    known = np.isfinite(one)
    np.testing.assert_allclose(mean[known], one[known], rtol=1e-4)
    np.testing.assert_array_equal(whole, plain)
    # exact headings agree: four times and twice the evidence about the direction
    same = ArrivalModel(shared_by_headings=1, bearing_weight=0)
    length = walk(rooms(), turned, source, same).log_belief
    mean, half, whole = (own[known] - length[known] for own in (mean, half, whole))
    np.testing.assert_allclose(whole, 4 * mean, rtol=1e-3)
    np.testing.assert_allclose(half, 2 * mean, rtol=1e-3)


def test_evidence_is_scored_again_when_the_map_changes():
    open_map = np.ones((1, SIZE, SIZE), np.float32)
    belief = walk(open_map, [(20, 5, 0)], (20, 25))
    before = belief.targets(open_map, ALL)[0]
    assert np.array_equal(before, (20, 25))
    walled = open_map.copy()
    walled[0, 10, 5:36] = np.inf
    belief.score(walled, ALL)
    assert belief.targets(walled, ALL)[0][1] < 10, "what is straight ahead is on this side now"


def test_forgotten_evidence_has_no_weight():
    model = ArrivalModel(kept=0.0)
    cost = np.ones((1, SIZE, SIZE), np.float32)
    one = ArrivalBelief(1, SIZE, BINS, model)
    one.hear(np.array([(10, 10, 0)]), *heard(cost, (10, 10, 0), (35, 35)), ALL)
    other = ArrivalBelief(1, SIZE, BINS, model)
    for belief in (one, other):
        belief.hear(np.array([(20, 20, 0)]), *heard(cost, (20, 20, 0), (20, 30)), ALL)
        belief.score(cost, ALL)
    assert np.array_equal(one.log_belief, other.log_belief)


def test_evidence_is_forgotten_by_what_new_clips_tell():
    cost = np.ones((1, SIZE, SIZE), np.float32)
    far, near = (35, 35), (20, 30)
    unknown = np.full((1, BINS), -math.log(BINS), np.float32)
    half = np.full((1, BINS), -math.log(BINS / 2), np.float32)
    half[0, BINS // 2 :] = -np.inf
    clear, distance = heard(cost, (20, 20, 0), near)

    def weight_of_first(bearing):
        belief = ArrivalBelief(1, SIZE, BINS, ArrivalModel(kept=0.5, forget_by="information"))
        belief.hear(np.array([(10, 10, 0)]), *heard(cost, (10, 10, 0), far), ALL)
        first = int(belief._newest[0])
        belief.hear(np.array([(20, 20, 0)]), bearing, distance, ALL)
        return float(belief._weight[0, first])

    assert weight_of_first(unknown) == pytest.approx(1), (
        "a clip that tells nothing replaces nothing"
    )
    assert weight_of_first(half) == pytest.approx(0.5 ** math.log(2))
    assert weight_of_first(clear) == pytest.approx(0.5 ** math.log(BINS), rel=0.1)


def test_with_forgetting_by_information_noise_leaves_what_was_heard_before():
    cost, source = np.ones((1, SIZE, SIZE), np.float32), (30, 22)
    noise = np.full((1, BINS), -math.log(BINS), np.float32), np.array([[2.0, 3.0]], np.float32)
    found = {}
    for forget_by in ("square", "information"):
        belief = ArrivalBelief(1, SIZE, BINS, ArrivalModel(kept=0.5, forget_by=forget_by))
        for x in (8, 10, 12):
            belief.hear(np.array([(x, 10, 0)]), *heard(cost, (x, 10, 0), source), ALL)
        for x in (13, 14, 15):
            belief.hear(np.array([(x, 10, 0)]), *noise, ALL)
        belief.score(cost, ALL)
        near = np.array([(0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)])
        found[forget_by] = belief.near(np.array([source]), near)[0]
    assert found["information"] > 2 * found["square"]


def test_headings_at_one_place_agree_on_the_map():
    cost, source = rooms(), (20, 17)
    once = walk(cost, [(12, 12, 0)], source)
    around = walk(cost, [(12, 12, h) for h in range(4)], source)
    assert np.array_equal(once.targets(cost, ALL), around.targets(cost, ALL))
    spread = [belief.near(np.array([source]), np.array([(0, 0)])) for belief in (once, around)]
    assert spread[1] > spread[0], "four observations are surer than one"


def test_the_probability_nearby_is_a_share_of_the_posterior():
    cost, source = rooms(), (20, 17)
    belief = walk(cost, [(12, 12, h) for h in range(4)], source)
    everywhere = np.stack(np.meshgrid(np.arange(SIZE), np.arange(SIZE)), -1).reshape(-1, 2)
    assert belief.near(np.array([(0, 0)]), everywhere) == pytest.approx(1)


def test_when_all_was_searched_the_search_begins_again():
    cost = rooms()
    belief = walk(cost, [(12, 12, 0)], (20, 17))
    belief.searched[:] = True
    belief.score(cost, ALL)
    found = belief.targets(cost, ALL)[0]
    assert np.isfinite(cost[0, found[1], found[0]])
    assert not belief.searched.any()


@pytest.mark.parametrize(
    ("key", "value"),
    [("places", 0), ("kept", 1.5), ("blur", 0.0), ("tail", 0.6), ("forget_by", "time")],
)
def test_settings_out_of_range_are_refused(key, value):
    with pytest.raises(UserError, match=f"planner.model.{key}"):
        ArrivalModel(**{key: value})


def louder(cost, poses, source, model, logs):
    """Belief where all lengths are heard wrong by one factor, as of a source of another level."""
    belief = ArrivalBelief(1, SIZE, BINS, model)
    for pose in poses:
        bearing, distance = heard(cost, pose, source)
        belief.hear(np.array([pose]), bearing, distance + np.float32([logs, 0]), ALL)
    belief.score(cost, ALL)
    return belief


def test_a_shared_error_of_the_lengths_is_integrated_out():
    # walking past the source: the level rises and falls, and the bearing turns
    cost, source = np.ones((1, SIZE, SIZE), np.float32), (20, 14)
    poses = [(x, 20, 1) for x in range(12, 22, 2)]
    known, unknown = ArrivalModel(kept=1.0), ArrivalModel(kept=1.0, bias=2.0)
    exact = louder(cost, poses, source, unknown, 0.0).targets(cost, ALL)[0]
    off = louder(cost, poses, source, unknown, 0.7).targets(cost, ALL)[0]
    assert np.abs(exact - source).max() <= 1
    assert np.abs(off - source).max() <= 1
    absolute = louder(cost, poses, source, known, 0.7)
    integrated = louder(cost, poses, source, unknown, 0.7)
    there = (0, source[1], source[0])
    for belief, most in ((absolute, -4.0), (integrated, 0.0)):
        lost = belief.log_belief[there] - belief.log_belief.max()
        assert (lost < most) == (belief is absolute)


def test_without_shared_error_it_is_the_sum_over_the_places():
    # a narrow prior of the shared error is none
    poses = [(12, 12, 0), (13, 12, 1), (14, 12, 1)]
    source = (20, 17)
    none = walk(rooms(), poses, source).log_belief
    narrow = walk(rooms(), poses, source, ArrivalModel(bias=1e-4)).log_belief
    there = np.isfinite(none)
    np.testing.assert_allclose(narrow[there], none[there], atol=0.05)


def test_the_best_square_has_the_greatest_probability_around_it():
    rng = np.random.default_rng(0)
    offsets = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (2, -1)])
    belief = ArrivalBelief(40, 15, 8, ArrivalModel())
    belief.log_belief[:] = rng.normal(0, 2, belief.log_belief.shape)
    belief.log_belief[rng.random(belief.log_belief.shape) < 0.5] = -np.inf
    every = np.ones(40, np.bool_)
    found = belief.targets(np.ones((40, 15, 15), np.float32), every, offsets)
    position = np.stack(np.meshgrid(np.arange(15), np.arange(15)), -1).reshape(-1, 2)
    for n in range(40):
        share = np.exp(belief.log_belief[n].astype(np.float64))
        wide = np.pad(share, 2)
        around = np.array(
            [sum(wide[y + 2 + v, x + 2 + u] for u, v in offsets) for x, y in position]
        )
        around[share.ravel() == 0] = 0
        assert tuple(found[n]) == tuple(position[around.argmax()])


def test_near_answers_for_active_agents_alone():
    belief = ArrivalBelief(3, 9, 8, ArrivalModel())
    belief.log_belief[:] = np.random.default_rng(1).normal(size=belief.log_belief.shape)
    position, offsets = np.full((3, 2), 4), np.array([(0, 0), (1, 1)])
    active = np.array([True, False, True])
    every, some = belief.near(position, offsets), belief.near(position, offsets, active)
    assert np.array_equal(some, np.where(active, every, 0))


def test_a_neglected_tail_leaves_the_likely_squares_as_they_are():
    poses, source = [(12, 12, 0), (13, 12, 1), (14, 12, 1), (15, 12, 1)], (17, 17)
    exact, neglecting = (ArrivalBelief(1, SIZE, BINS, ArrivalModel(tail=t)) for t in (0, 1e-3))
    for pose in poses:
        for belief in (exact, neglecting):
            belief.hear(np.array([pose]), *heard(rooms(), pose, source), ALL)
            belief.score(rooms(), ALL)
    scored = np.isfinite(neglecting.log_belief)
    assert np.array_equal(neglecting.log_belief[scored], exact.log_belief[scored])
    share = np.exp(exact.log_belief.astype(np.float64))
    assert 1 - share[scored].sum() / share.sum() < 1e-3
    assert scored.sum() < np.isfinite(exact.log_belief).sum() / 2


def test_a_source_that_was_heard_too_near_is_found_farther_away():
    cost, far = np.ones((1, SIZE, SIZE), np.float32), (38, 20)
    belief = ArrivalBelief(1, SIZE, BINS, ArrivalModel(kept=0.5, tail=0.01))
    for x in range(2, 12):
        pose = (x, 20, 1)
        belief.hear(np.array([pose]), *heard(cost, pose, (x + 2, 20) if x < 5 else far), ALL)
        belief.score(cost, ALL)
        if x == 4:
            assert not np.isfinite(belief.log_belief[0, 20, 38])
    assert np.abs(belief.targets(cost, ALL)[0] - far).max() <= 1


def test_where_all_that_is_near_was_searched_the_rest_is_scored():
    cost, pose = np.ones((1, SIZE, SIZE), np.float32), (5, 20, 1)
    belief = ArrivalBelief(1, SIZE, BINS, ArrivalModel(tail=0.01))
    for _ in range(5):
        belief.hear(np.array([pose]), *heard(cost, pose, (8, 20)), ALL)
        belief.score(cost, ALL)
    belief.searched |= np.isfinite(belief.log_belief)
    belief.score(cost, ALL)
    x, y = belief.targets(cost, ALL)[0]
    assert belief.searched.any(), "the search has not begun again"
    assert not belief.searched[0, y, x]
