"""Failures of actions have their probabilities, and dead reckoning counts what was asked for."""

import numpy as np
import pytest
import torch

from avn.core.errors import UserError
from avn.core.random import derive, scramble
from avn.navigation.odometry_noise import OdometryNoise, reckoned

FORWARD, BACKWARD, LEFT, RIGHT, STOP = range(5)
COUNT = 40_000
KEYS = scramble(derive("test"), np.arange(COUNT))


@pytest.mark.parametrize(
    ("action", "rates"),
    [(FORWARD, (0.1, 0)), (BACKWARD, (0.1, 0)), (LEFT, (0.1, 0.05)), (RIGHT, (0.1, 0.05)),
     (STOP, (0, 0))],
)  # fmt: skip
def test_failures_have_their_probabilities(action, rates):
    noise, step = OdometryNoise(0.1, 0.05), torch.full((COUNT,), 7)
    found = noise.failures(KEYS, step, torch.full((COUNT,), action))
    for own, rate in zip(found, rates, strict=True):
        assert abs(float(own.double().mean()) - rate) <= 4 * (rate / COUNT) ** 0.5
    assert not (found[0] & found[1]).any()


def test_a_failure_belongs_to_the_episode_and_the_step():
    noise, action = OdometryNoise(0.3, 0.3), torch.full((COUNT,), LEFT)
    steps = [torch.full((COUNT,), step) for step in (0, 0, 1)]
    first, same, later = (noise.failures(KEYS, step, action)[0] for step in steps)
    assert torch.equal(first, same)
    both = float((first & later).double().mean())
    assert abs(both - 0.09) < 0.01, "independent of the step before"


def test_a_square_walk_is_counted_back_to_its_start():
    pose = torch.zeros(1, 3, dtype=torch.int64)
    seen = []
    for action in [FORWARD, FORWARD, RIGHT] * 4:
        pose = reckoned(pose, torch.tensor([action]), torch.tensor([False]))
        seen.append(pose[0].tolist())
    assert seen[1] == [0, 2, 0]
    assert seen[4] == [2, 2, 1]
    assert seen[7] == [2, 0, 2]
    assert seen[-1] == [0, 0, 0]
    for action, blocked, expected in (
        (BACKWARD, False, [0, -1, 0]),
        (FORWARD, True, [0, 0, 0]),
        (LEFT, False, [0, 0, 3]),
        (STOP, False, [0, 0, 0]),
    ):
        assert (
            reckoned(pose, torch.tensor([action]), torch.tensor([blocked]))[0].tolist() == expected
        )


@pytest.mark.parametrize(
    ("options", "key"),
    [({"slip": -0.1}, "odometry.slip"), ({"turn": 1.1}, "odometry.turn"),
     ({"slip": 0.6, "turn": 0.6}, "odometry.slip, odometry.turn")],
)  # fmt: skip
def test_a_mistake_names_its_key(options, key):
    with pytest.raises(UserError, match=key):
        OdometryNoise(**options)
