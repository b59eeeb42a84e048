"""The occupancy mapper, and its map of what blocks sound."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from synthetic_scene import synthetic_scene
from tensordict import TensorDict

from avn.apartments.grid import squares_of
from avn.core.errors import UserError
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.planning.partial_graph import GraphRules


def seen(free: torch.Tensor, rooms: torch.Tensor) -> TensorDict:
    return TensorDict(
        {
            "odometry": torch.zeros(1, 3, dtype=torch.int64),
            "collided": torch.zeros(1, dtype=torch.bool),
            "local_patch": free[None],
            "local_rooms": rooms[None],
        },
        batch_size=[1],
    )


def test_sound_passes_over_furniture_and_not_through_walls() -> None:
    mapper = OccupancyMapper(size=21, rooms_above=0.05)
    assert mapper.needs == ("local_patch", "local_rooms")
    mapper.reset(1, GraphRules(0.05, 1.0))
    free, rooms = torch.ones(5, 5) * 0.9999, torch.ones(5, 5) * 0.9999
    free[1], free[3] = 0.0001, 0.0001  # a table across the second row, a wall across the fourth
    rooms[3] = 0.0001
    mapper.observe(seen(free, rooms), torch.tensor([-1]))
    walk, sound = mapper.graph.cost[0], mapper.sound_graph.cost[0]
    ahead = slice(8, 13)  # the agent is at (10, 10), and its rows are 11 to 15
    assert (walk[12, ahead] == torch.inf).all()
    assert (sound[12, ahead] == 1).all()
    assert (walk[14, ahead] == torch.inf).all()
    assert (sound[14, ahead] == torch.inf).all()
    assert (sound[5] == 1).all(), "where nothing is known, sound may go"


def test_the_true_map_has_the_true_walls() -> None:
    scene = synthetic_scene("a")
    start = torch.tensor([5, 8])
    mapper = OccupancyMapper(size=41, rooms_above=0.05)
    mapper.reset(2, GraphRules(0.05, 1.0))
    mapper.set_ground_truth("map", SimpleNamespace(scene=scene, start=start))  # type: ignore[arg-type]
    rooms = len(squares_of(scene.plan)[0])
    for agent in range(2):
        walk, sound = mapper.graph.cost[agent], mapper.sound_graph.cost[agent]
        assert np.isfinite(walk).sum() == scene.grid.cells
        assert np.isfinite(sound).sum() == rooms
        assert np.isfinite(sound[np.isfinite(walk)]).all()


def test_without_the_map_of_rooms_sound_goes_where_the_agent_goes() -> None:
    mapper = OccupancyMapper(size=21)
    mapper.reset(1, GraphRules())
    assert mapper.needs == ("local_patch",)
    assert mapper.sound_graph is None


def test_a_threshold_out_of_range_is_refused() -> None:
    with pytest.raises(UserError, match=r"mapper\.rooms_above: 1\.5; give 0 to 1, or null"):
        OccupancyMapper(rooms_above=1.5)
