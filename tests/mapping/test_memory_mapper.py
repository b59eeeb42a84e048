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


def test_a_memory_that_does_not_grow_keeps_to_the_places_of_the_walk():
    mapper = begun(localisation="retrieval", grows=False, heading="nearest", top=3)
    cost, walls = mapper.graph.cost.copy(), mapper.graph.walls.copy()
    # like the first, the second and the last picture, in this order: east, east, west
    picture = torch.nn.functional.normalize(torch.tensor([3.0, 2, 0, 0, 0, 1]), dim=0)
    for _ in range(2):  # a second look finds no entry of its own
        look(mapper, picture)
        mean = torch.tensor([(0 + 1 + 0) / 3, (0 + 0 + 1) / 3], dtype=torch.float64)
        assert torch.allclose(mapper.location[0], mean + CENTRE)
        assert (mapper.pose[0] - torch.tensor([CENTRE, CENTRE, 0])).tolist() == [0, 0, EAST]
    assert (mapper.graph.cost == cost).all()
    assert (mapper.graph.walls == walls).all()


def test_between_places_of_the_walk_it_is_at_the_nearest_one():
    far = [(0, 0, NORTH), (0, 1, NORTH), (0, 2, NORTH), (0, 3, NORTH), (0, 4, NORTH)]
    mapper = MemoryMapper(SIZE, localisation="retrieval", grows=False, top=2)
    mapper.reset(1, GraphRules())
    # two pictures of the walk, at (0, 0) and (4, 0), and places between them that it did not visit
    walk = [*far, *[(x, 4, EAST) for x in range(5)], *[(4, y, SOUTH) for y in range(3, -1, -1)]]
    mapper.explore(walk_of(walk), torch.zeros(1, dtype=torch.int64))
    look(
        mapper,
        torch.nn.functional.normalize(torch.eye(len(walk))[0] + torch.eye(len(walk))[-1], dim=0),
    )
    assert (mapper.location[0] - CENTRE).tolist() == [2.0, 0.0]
    assert (mapper.pose[0, :2] - CENTRE).tolist() == [0, 0]  # the first of those equally near


def test_only_visited_squares_are_nodes_above_the_probability_of_unknown_ones():
    mapper = MemoryMapper(SIZE, localisation="retrieval", grows=False)
    mapper.reset(1, GraphRules(obstacle_threshold=0.6))
    mapper.explore(walk_of(ROUND), torch.zeros(1, dtype=torch.int64))
    rows, columns = (mapper.graph.cost[0] < float("inf")).nonzero()
    places = set(zip((columns - CENTRE).tolist(), (rows - CENTRE).tolist(), strict=True))
    assert places == {(0, 0), (1, 0), (1, 1), (0, 1)}


def test_the_heading_is_the_most_frequent_one_or_the_nearest_one_s():
    picture = torch.nn.functional.normalize(torch.tensor([0, 0, 3.0, 0, 2.0, 1.9]), dim=0)
    for heading, expected in (("vote", WEST), ("nearest", NORTH)):
        mapper = begun(localisation="retrieval", heading=heading, top=3)
        look(mapper, picture)
        assert int(mapper.pose[0, 2]) == expected
    with pytest.raises(UserError, match=r"mapper.heading: 'mean'; give vote or nearest"):
        begun(heading="mean")


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
