import dataclasses

import networkx as nx
import numpy as np
import pytest

from avn.core.actions import MOVES, STOP, transitions
from avn.navigation.distances import UNREACHABLE, actions_to_cells, fewest_actions, measure
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.protocols import Protocol

MAZE = """
aaaa#bb
a##aabb
aAaa#bB
a#aa#bb
aaaa##b
"""


def test_lengths_of_the_corridor(corridor: DrawnScene, protocols: dict[str, Protocol]) -> None:
    var, stop = (measure(corridor, protocols[name]) for name in ("var", "stop"))
    # To the goal cells 0 and 1 in moves, and to the source in metres.
    assert var.shortest[0].tolist() == [0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9]
    assert stop.shortest[0].tolist() == [0.5 * moves for moves in range(11)]


def test_fewest_actions_agrees_with_dijkstra_over_states_and_moves_left(
    protocols: dict[str, Protocol],
) -> None:
    scene = draw("maze", MAZE)
    table = transitions(scene.grid.neighbours)
    most = 12
    goal = protocols["var"].goal_cells(scene.grid, scene.sources)
    graph = nx.DiGraph()
    for left in range(most + 1):
        for state, nexts in enumerate(table.tolist()):
            for action, after in enumerate(nexts[:STOP]):
                remaining = left - (action in MOVES)
                if remaining >= 0 and after != state:
                    graph.add_edge((after, remaining), (state, left))
    costs = fewest_actions(scene.grid.neighbours, goal, most)
    assert costs.shape == (most + 1, 2, len(table))
    for source in range(2):
        ends = {
            (state, left)
            for state in range(len(table))
            for left in range(most + 1)
            if goal[source, state // 4]
        }
        expected = nx.multi_source_dijkstra_path_length(graph, ends, weight=None)
        for left in range(most + 1):
            for state in range(len(table)):
                wanted = expected.get((state, left), UNREACHABLE)
                assert min(int(costs[left, source, state]), UNREACHABLE) == wanted


def test_actions_to_cells_agree_with_breadth_first_search() -> None:
    scene = draw("maze", MAZE)
    table = transitions(scene.grid.neighbours)
    graph = nx.DiGraph(
        (after, state) for state, nexts in enumerate(table.tolist()) for after in nexts[:STOP]
    )
    found = actions_to_cells(scene.grid.neighbours, scene.sources)
    for cell, costs in zip(scene.sources.tolist(), found.tolist(), strict=True):
        ends = {4 * cell + heading for heading in range(4)}
        expected = nx.multi_source_dijkstra_path_length(graph, ends, weight=None)
        assert costs == [expected[state] for state in range(len(table))]


def test_actions_to_cells_may_go_round_to_save_turns() -> None:
    # Stairs of ten moves and nine turns, and a way round of twelve moves and fewer turns.
    scene = draw("stairs", """
        aaaaaaA
        a####aa
        a###aa#
        a##aa##
        a#aa###
        aaa####
    """)  # fmt: skip
    start = 4 * scene.grid.lattice.tolist().index([2, 0]) + 3
    source = int(scene.sources[0])
    moves = int(scene.grid.distances[source, start // 4])
    costs = actions_to_cells(scene.grid.neighbours, scene.sources)[0, start]
    goal = np.zeros((1, scene.grid.cells), dtype=bool)
    goal[0, source] = True
    shortest = fewest_actions(scene.grid.neighbours, goal, moves)[moves, 0, start]
    assert (moves, shortest, costs) == (9, 17, 15)


@pytest.mark.parametrize("path_length", ["moves", "metres"])
def test_a_cap_to_the_goal_is_shorter_by_the_way_from_the_goal_to_the_source(
    corridor: DrawnScene, protocols: dict[str, Protocol], path_length: str
) -> None:
    var = dataclasses.replace(protocols["var"], path_length=path_length)
    to_source = measure(corridor, var)
    to_goal = measure(corridor, dataclasses.replace(var, cap="goal"))
    assert to_source.most_moves[0].tolist() == [2 * i for i in range(11)]
    assert to_goal.most_moves[0].tolist() == [0, *(2 * (i - 1) for i in range(1, 11))]
    assert (to_source.shortest == to_goal.shortest).all()


def test_turning_of_the_first_heading_counts(corridor: DrawnScene) -> None:
    goal = np.zeros((1, 11), dtype=bool)
    goal[0, 0] = True
    costs = fewest_actions(corridor.grid.neighbours, goal, 3)[3, 0, 4 * 3 : 4 * 3 + 4]
    # North and south turn once; east walks backward and west forward.
    assert costs.tolist() == [4, 3, 4, 3]


def test_crossings_take_the_shortest_walk_with_the_fewest_borders(
    protocols: dict[str, Protocol],
) -> None:
    # Both ways round are six moves; the northern one enters two rooms, the southern one none.
    scene = draw("ring", "abbca\na###a\nAaaaa")
    crossings = measure(scene, protocols["var"]).crossings[0]
    corner = int(np.flatnonzero((scene.grid.lattice == [4, 2]).all(axis=1))[0])
    assert crossings[corner] == 0
    by_cell = dict(zip(map(tuple, scene.grid.lattice.tolist()), crossings.tolist(), strict=True))
    assert by_cell[1, 2] == 1
    assert by_cell[2, 2] == 1
    assert by_cell[3, 2] == 2


def test_crossings_count_each_doorway_once(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    crossings = measure(two_rooms, protocols["stop"]).crossings
    assert (
        crossings == (two_rooms.grid.rooms[two_rooms.sources][:, None] != two_rooms.grid.rooms)
    ).all()
