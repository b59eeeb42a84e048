import numpy as np
import pytest
import torch

from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.occupancy_map import OccupancyMap

NORTH, EAST, SOUTH, WEST = range(4)


def at(beliefs: OccupancyMap, n: int, right: int, front: int) -> float:
    return float(beliefs.belief[n, beliefs.centre + front, beliefs.centre + right])


def pose(*rows: tuple[int, int, int]) -> torch.Tensor:
    return torch.tensor(rows)


def test_nothing_is_known_at_first() -> None:
    assert (OccupancyMap(2, 21).belief == 0.5).all()


def test_two_pictures_multiply_their_odds() -> None:
    # Moravec: odds 3 and odds 4 make odds 12; and 0.8 takes 0.2 back to a half.
    beliefs = OccupancyMap(2, 21)
    start = pose((0, 0, NORTH), (0, 0, NORTH))
    window = torch.full((2, 5, 5), torch.nan)
    window[:, 0, 2] = torch.tensor([0.75, 0.2])
    beliefs.mark_visited(start)
    beliefs.integrate(start, window)
    # The square ahead of the start, seen from the right of it facing west.
    side = pose((1, 1, WEST), (1, 1, WEST))
    window[:, 0, 2] = torch.tensor([0.8, 0.8])
    beliefs.integrate(side, window)
    assert at(beliefs, 0, 0, 1) == pytest.approx(12 / 13, abs=1e-5)
    assert at(beliefs, 1, 0, 1) == pytest.approx(0.5, abs=1e-5)


def test_a_picture_counts_once() -> None:
    beliefs = OccupancyMap(1, 21)
    start, window = pose((0, 0, NORTH)), torch.full((1, 5, 5), 0.7)
    beliefs.mark_visited(start)
    for _ in range(3):
        beliefs.integrate(start, window)
    assert at(beliefs, 0, 1, 3) == pytest.approx(0.7, abs=1e-5)


@pytest.mark.parametrize(
    ("heading", "ahead_left"),
    [(NORTH, (-2, 1)), (EAST, (1, 2)), (SOUTH, (2, -1)), (WEST, (-1, -2))],
)
def test_the_window_turns_with_the_agent(heading: int, ahead_left: tuple[int, int]) -> None:
    beliefs = OccupancyMap(1, 21)
    window = torch.full((1, 5, 5), torch.nan)
    window[0, 0, 0] = 0.9  # nearest row, leftmost column
    beliefs.mark_visited(pose((0, 0, heading)))
    beliefs.integrate(pose((0, 0, heading)), window)
    assert at(beliefs, 0, *ahead_left) == pytest.approx(0.9, abs=1e-5)
    assert int((beliefs.belief > 0.55).sum()) == 2  # and the agent's own square


def test_what_was_stood_on_outweighs_pictures() -> None:
    beliefs = OccupancyMap(1, 21)
    beliefs.mark_visited(pose((0, 1, NORTH)))
    beliefs.mark_visited(pose((0, 0, NORTH)))
    beliefs.integrate(pose((0, 0, NORTH)), torch.full((1, 5, 5), 0.0))
    assert at(beliefs, 0, 0, 1) > 0.999
    assert at(beliefs, 0, 1, 1) < 0.001


def test_a_bump_blocks_the_square_or_the_way_to_a_visited_one() -> None:
    beliefs = OccupancyMap(2, 21)
    beliefs.mark_visited(pose((0, 1, NORTH), (5, 5, NORTH)))
    beliefs.mark_visited(pose((0, 0, NORTH), (0, 0, NORTH)))
    here = pose((0, 0, NORTH), (0, 0, NORTH))
    beliefs.mark_collision(here, torch.tensor([NORTH, NORTH]), torch.tensor([True, True]))
    middle = beliefs.centre
    assert at(beliefs, 0, 0, 1) > 0.999  # was there: it is the way that is blocked
    assert beliefs.walls[0, middle, middle] == 1 << NORTH
    assert beliefs.walls[0, middle + 1, middle] == 1 << SOUTH
    assert at(beliefs, 1, 0, 1) < 0.001
    assert not beliefs.walls[1].any()
    beliefs.mark_collision(here, torch.tensor([EAST, EAST]), torch.tensor([False, False]))
    assert at(beliefs, 0, 1, 0) == 0.5


def test_pictures_at_the_border_change_nothing_outside_or_elsewhere() -> None:
    beliefs = OccupancyMap(1, 11)
    edge = pose((0, 5, NORTH))
    beliefs.mark_visited(edge)
    before = beliefs.log_odds.clone()
    beliefs.integrate(edge, torch.full((1, 5, 5), 0.9))
    assert torch.equal(beliefs.log_odds, before)
    with pytest.raises(UserError, match=r"mapper.size: an agent walked off a map of 11"):
        beliefs.mark_visited(pose((0, 6, NORTH)))


@pytest.mark.parametrize("size", [9, 12, -1])
def test_sizes_that_cannot_work_are_refused(size: int) -> None:
    with pytest.raises(UserError, match=rf"mapper.size: {size}; give an odd number"):
        OccupancyMap(1, size)


def test_turned_offsets_are_the_papers_example() -> None:
    # The source at (16, 18), the agent at (4, 8): facing west it hears it at (10, -12).
    heard = torch.tensor([[12, 10], [10, -12]])
    headings = torch.tensor([NORTH, WEST])
    assert turned(heard, headings).tolist() == [[12, 10], [12, 10]]


def test_episodes_do_not_touch_one_another() -> None:
    rng = np.random.default_rng(0)
    poses = torch.from_numpy(rng.integers(-4, 5, (6, 20, 3)))
    poses[..., 2] %= 4
    windows = torch.from_numpy(rng.random((6, 20, 5, 5))).float()
    together, alone = OccupancyMap(6, 31), [OccupancyMap(1, 31) for _ in range(6)]
    for step in range(20):
        together.mark_visited(poses[:, step])
        together.integrate(poses[:, step], windows[:, step])
        for n, own in enumerate(alone):
            own.mark_visited(poses[n : n + 1, step])
            own.integrate(poses[n : n + 1, step], windows[n : n + 1, step])
    torch.testing.assert_close(together.log_odds, torch.cat([own.log_odds for own in alone]))
