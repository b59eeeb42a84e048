import torch

from avn.core.pose import turned
from avn.mapping.frames import FrameAligner, turned_walls


def test_an_equal_picture_tells_where_the_walk_lies() -> None:
    torch.manual_seed(0)
    turn, shift = torch.arange(4), torch.tensor([[3, -2], [0, 5], [-7, 1], [4, 4]])
    votes = FrameAligner(4, 41, 0.02)
    pose = torch.tensor([[1, 2, 3]] * 4)
    place = turned(pose[:, :2], turn) + shift
    true = torch.cat((place, ((pose[:, 2] + turn) % 4)[:, None]), dim=1)
    poses = torch.stack((true, torch.randint(-5, 6, (4, 3)), torch.randint(-5, 6, (4, 3))), dim=1)
    poses[..., 2] %= 4
    changed = votes.vote(pose, torch.tensor([[1.0, 0.8, 0.8]] * 4), poses, 0.5)
    assert changed.all()
    found, way, known = votes.best()
    assert known.all()
    assert torch.equal(found, shift)
    assert torch.equal(way, turn)


def test_pictures_that_are_little_alike_decide_nothing_and_count_once() -> None:
    votes = FrameAligner(1, 41, 0.02)
    pose, poses = torch.tensor([[0, 0, 0]]), torch.tensor([[[3, 3, 0]]])
    for _ in range(1000):
        votes.vote(pose, torch.tensor([[0.9]]), poses, 0.5)
    assert not votes.best()[2].any()


def test_a_refused_winner_never_returns_and_a_settled_one_always_wins() -> None:
    votes = FrameAligner(2, 41, 0.02)
    pose = torch.zeros(2, 3, dtype=torch.int64)
    poses = torch.tensor([[[3, 3, 0]]] * 2)
    votes.vote(pose, torch.ones(2, 1), poses, 0.5)
    assert votes.reject(torch.tensor([True, False])).tolist() == [True, False]
    for step in range(3):
        walked, seen = pose.clone(), poses.clone()
        walked[:, 0], seen[:, 0, 0] = step, 3 + step
        votes.vote(walked, torch.ones(2, 1), seen, 0.5)
    assert votes.best()[2].tolist() == [False, True]
    votes.set(torch.tensor([[1, 2], [1, 2]]), torch.tensor([3, 3]))
    votes.vote(pose, torch.ones(2, 1), poses, 0.5)
    shift, turn, _ = votes.best()
    assert shift.tolist() == [[1, 2], [1, 2]]
    assert turn.tolist() == [3, 3]


def test_walls_turn_with_the_frame() -> None:
    # A wall to the east of the walk's frame lies to the north of one that is turned to the east.
    walls = torch.tensor([[1 << 1]] * 4, dtype=torch.uint8)
    assert turned_walls(walls, torch.arange(4)).tolist() == [[2], [1], [8], [4]]
