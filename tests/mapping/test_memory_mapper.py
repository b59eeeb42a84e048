"""The spatial memory as a map: places by pictures, edges of the walk, votes that lay the walk."""

import pytest
import torch
from tensordict import TensorDict

from avn.core.errors import UserError
from avn.mapping.memory_mapper import MemoryMapper
from avn.planning.partial_graph import GraphRules

SIZE, CENTRE = 21, 10
NORTH, EAST, SOUTH, WEST = range(4)
# Round a block of 2 x 2 squares: right, up, left; the first and the last square are neighbours.
ROUND = [(0, 0, EAST), (1, 0, EAST), (1, 0, NORTH), (1, 1, NORTH), (1, 1, WEST), (0, 1, WEST)]


def walk_of(poses) -> TensorDict:
    """One walk whose pictures are all different."""
    count = len(poses)
    observed = {
        "visual_embedding": torch.eye(count)[None],
        "odometry": torch.tensor(poses)[None],
        "collided": torch.zeros(1, count, dtype=torch.bool),
    }
    return TensorDict(observed, batch_size=[1, count])


def begun(**settings) -> MemoryMapper:
    """A mapper that has explored; its agent has seen nothing yet."""
    mapper = MemoryMapper(SIZE, **settings)
    mapper.reset(1, GraphRules())
    mapper.explore(walk_of(ROUND), torch.zeros(1, dtype=torch.int64))
    return mapper


def look(mapper: MemoryMapper, feature: torch.Tensor, odometry=(0, 0, 0)) -> None:
    observation = {
        "visual_embedding": feature[None],
        "odometry": torch.tensor([odometry]),
        "collided": torch.zeros(1, dtype=torch.bool),
    }
    mapper.observe(TensorDict(observation, batch_size=[1]), torch.tensor([-1]))


def believed(mapper: MemoryMapper) -> dict[tuple[int, int], float]:
    """Squares that are believed to be anything, by right and front from the map's centre."""
    belief = mapper.belief(torch.tensor([0]))[0]
    front, right = (belief != 0.5).nonzero().T
    places = zip(right.tolist(), front.tolist(), strict=True)
    return {(x - CENTRE, y - CENTRE): float(belief[y, x]) for x, y in places}


@pytest.mark.parametrize("step", range(len(ROUND)))
def test_by_retrieval_it_is_where_it_saw_the_picture(step):
    mapper = begun(localisation="retrieval", top=1)
    look(mapper, torch.eye(len(ROUND))[step], odometry=(5, 5, 1))  # which it does not look at
    assert (mapper.pose[0] - torch.tensor([CENTRE, CENTRE, 0])).tolist() == list(ROUND[step])
    assert mapper.in_exploration_frame
    assert set(believed(mapper)) == {(0, 0), (1, 0), (1, 1), (0, 1)}


@pytest.mark.parametrize(("edges", "joined"), [("consecutive", False), ("adjacent", True)])
def test_edges_are_where_the_walk_went_or_between_all_neighbours(edges, joined):
    walls = begun(localisation="retrieval", edges=edges).graph.walls[0]
    first, last = walls[CENTRE, CENTRE], walls[CENTRE + 1, CENTRE]
    assert bool(first >> NORTH & 1) == bool(last >> SOUTH & 1) == (not joined)
    assert not first >> EAST & 1  # it went there
    assert not walls[CENTRE, CENTRE + 1] >> NORTH & 1


@pytest.mark.parametrize(
    ("settings", "overlaid"),
    [
        # a picture less alike by 0.02 has exp(-1) = 0.37 votes
        ({"sharpness": 0.02, "confidence": 0.5}, False),
        ({"sharpness": 0.02, "confidence": 0.3}, True),
        ({"sharpness": 0.05, "confidence": 0.5}, True),
        ({"sharpness": 0.05, "confidence": 0.7}, False),
    ],
)
def test_the_walk_is_laid_over_the_map_from_enough_votes_on(settings, overlaid):
    mapper = begun(top=1, **settings)
    alike = torch.zeros(len(ROUND) + 1)
    alike[3], alike[-1] = 0.98, (1 - 0.98**2) ** 0.5
    # one picture more than the walk has, so that the cosine with the fourth is 0.98
    memory = torch.nn.functional.pad(torch.eye(len(ROUND)), (0, 1))[None]
    trajectories = walk_of(ROUND)
    trajectories["visual_embedding"] = memory
    mapper.reset(1, GraphRules())
    mapper.explore(trajectories, torch.zeros(1, dtype=torch.int64))
    look(mapper, alike)
    assert (len(believed(mapper)) > 1) == overlaid


def test_the_walk_lies_where_the_picture_says_turned_as_the_agent_is():
    mapper = begun(top=1)
    # it stands at its own start, facing its own north, where the walk stood at (1, 1) facing west
    look(mapper, torch.eye(len(ROUND))[4])
    # what lay west of there is ahead of the agent, and what lay south of there on its left
    assert set(believed(mapper)) == {(0, 0), (0, 1), (-1, 0), (-1, 1)}
    assert (mapper.pose[0, :2] == CENTRE).all()


def test_it_must_have_explored():
    mapper = MemoryMapper(SIZE)
    mapper.reset(1, GraphRules())
    with pytest.raises(UserError, match="nothing was explored"):
        look(mapper, torch.eye(len(ROUND))[0])


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ({"localisation": "gps"}, "localisation: 'gps' is none of"),
        ({"edges": "all"}, "mapper.edges: 'all'; give consecutive or adjacent"),
        ({"sharpness": 0.0}, "mapper.sharpness and mapper.confidence are over 0"),
        ({"confidence": -1.0}, "mapper.sharpness and mapper.confidence are over 0"),
    ],
)
def test_settings_that_cannot_work_are_refused(settings, line):
    with pytest.raises(UserError, match=line):
        MemoryMapper(SIZE, **settings)
