"""An agent that explores frontiers in the heard direction in two rooms, with exact senses."""

import pytest
import torch
from heard_places import BINS, SIZE, arrival, first_action, heard, run
from small_places import FLAT, STOP, VAR

from avn.agents.frontier_agent import FrontierAgent
from avn.core.actions import FORWARD, ROTATE_LEFT, ROTATE_RIGHT
from avn.core.errors import UserError
from avn.mapping.base import Mapper
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.navigation_scene import draw


class Mapless(OccupancyMapper):
    """Mapper without a map of squares."""

    belief = Mapper.belief


def explorer(**settings):
    return FrontierAgent(OccupancyMapper(SIZE), obstacle_threshold=0.01, **settings)


def test_it_turns_to_the_frontier_in_the_heard_direction():
    out_of_sight = arrival([0, 90, 270, 180])
    out_of_sight[:, BINS + 2] = -5.0
    found = first_action(explorer(), VAR, out_of_sight).tolist()
    # what is beside and behind the agent is unknown at first
    assert found[:3] == [FORWARD, ROTATE_RIGHT, ROTATE_LEFT]
    assert found[3] in (ROTATE_LEFT, ROTATE_RIGHT)


def test_in_sight_it_walks_to_where_it_hears_the_source():
    # heard behind by its direction, and ahead by its place
    values = arrival([180, 180])
    values[:, BINS + 2] = torch.tensor([5.0, -5.0])
    values[:, BINS + 4] = 3.0
    seen, unseen = first_action(explorer(), VAR, values).tolist()
    assert seen == FORWARD
    assert unseen != FORWARD
    assert first_action(explorer(sight_above=1), VAR, values).tolist() == [unseen, unseen]


@pytest.mark.parametrize("protocol", [VAR, STOP], ids=["var", "stop"])
def test_with_true_senses_it_arrives(protocol):
    frame = run(explorer(stop_within=0.6), protocol)
    assert frame["success"].mean() > 0.95
    assert frame["spl"].mean() > 0.8


def test_a_source_that_is_never_in_sight_is_found_when_all_is_explored():
    hidden = heard(draw("flat", FLAT))
    hidden[..., BINS + 2] = -10.0
    assert run(explorer(stop_within=0.6), STOP, hidden)["success"].mean() > 0.9


def test_settings_out_of_range_are_refused():
    for key, value in (("sector", 0), ("sector", 200), ("sight_above", 2)):
        with pytest.raises(UserError, match=rf"planner\.{key}: {value}"):
            explorer(**{key: value})
    with pytest.raises(UserError, match="mapper: Mapless has no map of squares"):
        FrontierAgent(Mapless(SIZE))
