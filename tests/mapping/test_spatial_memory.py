import pytest
import torch

from avn.core.errors import UserError
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate


def memory(top: int = 3) -> SpatialMemory:
    keys = torch.eye(4)[None]
    values = torch.tensor([[[0, 0, 0], [2, 0, 1], [4, 3, 1], [9, 9, 3]]])
    return SpatialMemory(keys, values, torch.zeros(2, dtype=torch.int64), top)


def query(*weights: float) -> torch.Tensor:
    feature = torch.tensor([weights])
    return (feature / feature.norm()).expand(2, -1)


def test_the_place_is_the_mean_of_the_three_most_alike() -> None:
    similarity, poses = memory().recall(query(0.5, 0.6, 0.7, 0.1))
    assert (similarity[0].diff() <= 0).all()
    # (0, 0), (2, 0) and (4, 3); two of three face heading 1.
    assert locate(similarity, poses)[0].tolist() == [2.0, 1.0, 1.0]


def test_of_equal_votes_the_most_alike_has_the_heading() -> None:
    poses = torch.tensor([[[0, 0, 2], [0, 0, 0], [0, 0, 3]]])
    assert locate(torch.tensor([[0.9, 0.8, 0.7]]), poses)[0, 2] == 2


def test_it_grows_with_each_agents_own_pictures() -> None:
    both = memory(top=1)
    new = query(1.0, 1.0, 1.0, 1.0)
    both.add(new, torch.tensor([[7, 7, 2], [8, 8, 0]]), torch.tensor([True, False]))
    similarity, poses = both.recall(new)
    assert poses[0, 0].tolist() == [7, 7, 2]
    assert similarity[0, 0] == pytest.approx(1.0)
    assert similarity[1, 0] == pytest.approx(0.5)
    assert both.recall(new, own=False)[0][0, 0] == pytest.approx(0.5)
    for number in range(40):  # past what it was first laid out for
        both.add(new, torch.tensor([[number, 0, 0]] * 2), torch.tensor([True, True]))
    assert both.recall(new)[1].shape == (2, 1, 3)


def test_fewer_entries_than_asked_for_are_averaged() -> None:
    one = SpatialMemory(torch.eye(4)[None, :1], torch.tensor([[[3, 4, 2]]]), torch.zeros(1).long())
    assert locate(*one.recall(query(1.0, 0, 0, 0)[:1]))[0].tolist() == [3.0, 4.0, 2.0]


def test_padding_is_no_entry() -> None:
    features = torch.nn.functional.normalize(torch.rand(2, 4, 5), dim=-1)
    poses = torch.tensor([[[0, 0, 0]] * 4, [[0, 0, 0], [1, 0, 0], [0, 0, 0], [2, 0, 0]]])
    keys, values = distinct(features, poses)
    assert keys.shape == (2, 3, 5)
    assert values[1].tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    assert torch.equal(keys[1], features[1, [0, 1, 3]])
    own = SpatialMemory(keys, values, torch.tensor([0]))
    similarity, poses = own.recall(-features[0, :1])
    assert similarity[0].isinf().tolist() == [False, True, True]
    assert locate(similarity, poses)[0].tolist() == [0.0, 0.0, 0.0]


def test_an_empty_memory_is_refused_in_one_line() -> None:
    empty = SpatialMemory(torch.zeros(1, 0, 4), torch.zeros(1, 0, 3).long(), torch.zeros(1).long())
    with pytest.raises(UserError, match="the spatial memory has no entry; explore first"):
        empty.recall(query(1.0, 0, 0, 0)[:1])
    with pytest.raises(UserError, match=r"mapper.top: 0"):
        memory(top=0)
