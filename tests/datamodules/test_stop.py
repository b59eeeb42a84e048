import numpy as np
import pytest
import torch
from small import option
from synthetic_scene import synthetic_scene, synthetic_sounds

from avn.acoustics.microphone import Microphone
from avn.apartments.grid import goal_cells
from avn.core.errors import UserError
from avn.datamodules.stop import GoalBalancedSampler, StopData, moves_to_goal


def goal(scene) -> np.ndarray:
    return goal_cells(scene.grid)[scene.sources]


def data(goal=goal, **changes) -> StopData:
    recipe = option("stop_model", "cnn5", **{"batch": 16, "validation_clips": 50, **changes})
    scenes = [synthetic_scene("a", 4.0)], [synthetic_scene("b", 4.5)]
    return StopData(*scenes, synthetic_sounds(), Microphone(), recipe, goal)


def test_moves_are_those_of_the_shortest_walk_to_the_goal() -> None:
    scene = synthetic_scene("a", 4.0)
    reached = goal(scene)
    moves = moves_to_goal(scene, reached)
    assert moves.shape == (2, 4 * scene.grid.cells)
    for source in range(2):
        for cell in range(scene.grid.cells):
            nearest = min(scene.grid.distances[cell][reached[source]])
            assert (moves[source, 4 * cell : 4 * cell + 4] == int(nearest)).all()
    assert (moves.reshape(2, -1, 4)[..., 0].numpy() == 0).tolist() == reached.tolist()


def test_an_epoch_shows_the_goal_as_often_as_it_should() -> None:
    module = data(positives=0.4)
    clips = module.train_clips
    sampler = module.train_sampler()
    assert isinstance(sampler, GoalBalancedSampler)
    orders = []
    for epoch in (0, 1, 1):
        sampler.set_epoch(epoch)
        items = torch.tensor(list(sampler))
        assert len(items) == len(sampler) == clips.pairs
        assert len(items.unique()) == len(items)
        pair = items // len(clips.sounds.names) % clips.pairs
        at_goal = clips.target[pair] == 0
        assert float(at_goal.float().mean()) == pytest.approx(0.4, abs=0.01)
        # Each pair at the goal comes about as often as the others there.
        counts = torch.bincount(pair[at_goal], minlength=clips.pairs)[clips.target == 0]
        assert int(counts.max() - counts.min()) <= 1
        assert int(torch.bincount(pair[~at_goal]).max()) == 1
        orders.append(items)
    assert torch.equal(orders[1], orders[2])
    realisations = [order // len(clips) for order in orders]
    assert int(realisations[0].max()) < int(realisations[1].min())


def test_the_prior_is_the_share_of_states_at_the_goal() -> None:
    module = data()
    shares = [goal(scene).mean() for scene in module.scenes["train"]]
    assert module.prior == pytest.approx(shares[0])


def test_a_goal_that_is_everywhere_is_one_line() -> None:
    with pytest.raises(UserError, match=r"protocol\.radius: every cell"):
        data(goal=lambda scene: np.ones((2, scene.grid.cells), dtype=bool))


def test_a_bad_number_is_named_by_its_own_node() -> None:
    with pytest.raises(UserError, match=r"stop_model\.validation_clips"):
        data(validation_clips=0)
