import dataclasses

import numpy as np
import pandas as pd
import pytest
import torch
from small_places import FLAT, STOP, VAR
from torch import Tensor

from avn.agents.planner_agent import PlannerAgent
from avn.agents.rollout import Labels, rollout_scene
from avn.apartments.local_patch import window_cells
from avn.core.errors import UserError
from avn.dataset.source_locations import relative_locations
from avn.mapping.memory_mapper import MemoryMapper
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.episodes import exhaustive_episodes, frozen_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol

LABELS = Labels("ours", "resonance")


def flat() -> DrawnScene:
    return draw("flat", FLAT)


def truth(scene: DrawnScene, protocol: Protocol = VAR) -> dict[str, Tensor]:
    """Hearing that tells the very place of the source, and whether it is within reach."""
    lattice = torch.from_numpy(scene.grid.lattice).long()
    sources = torch.from_numpy(np.asarray(scene.sources)).long()
    goal = torch.from_numpy(protocol.goal_cells(scene.grid, np.asarray(scene.sources)))
    return {
        "source_estimate": relative_locations(lattice, sources)[:, :, None, None],
        "stop_probability": goal.repeat_interleave(4, dim=1)[:, :, None, None].float(),
    }


def windows(scene: DrawnScene) -> Tensor:
    """What cannot see through walls is not needed here: all cells are known."""
    return torch.from_numpy(window_cells(scene.grid) >= 0).float()


def looks(scene: DrawnScene) -> Tensor:
    """Pictures that change smoothly with the place and sharply with the heading."""
    where = torch.from_numpy(scene.grid.centres).float().repeat_interleave(4, dim=0)
    facing = torch.arange(4).repeat(len(scene.grid.centres))
    generator = torch.Generator().manual_seed(1)
    waves = torch.randn(2, 128, generator=generator) * 2
    phase = torch.rand(4, 128, generator=generator) * 6.28
    return torch.nn.functional.normalize(torch.cos(where @ waves + phase[facing]), dim=1)


def run(agent: PlannerAgent, scene: DrawnScene, protocol: Protocol = VAR) -> pd.DataFrame:
    seen = {"local_patch": windows(scene), "visual_embedding": looks(scene)}
    if agent.explores:
        episodes = frozen_episodes(scene, ["ring"], protocol, seed=0)
    else:
        episodes = exhaustive_episodes(scene, ["ring"], protocol, seed=0)
    return rollout_scene(
        agent, scene, episodes, protocol, LABELS, SceneObservations(truth(scene, protocol), seen)
    )


@pytest.mark.parametrize("protocol", [VAR, STOP], ids=["var", "stop"])
@pytest.mark.parametrize("look", ["once", "around"])
@pytest.mark.parametrize("source", ["latest", "bayes"])
def test_with_true_senses_it_always_arrives(protocol: Protocol, look: str, source: str) -> None:
    frame = run(
        PlannerAgent(OccupancyMapper(41), look=look, source_filter=source), flat(), protocol
    )
    assert frame["success"].mean() > 0.99
    assert frame["spl"].mean() > 0.8
    assert frame["collisions"].sum() == 0


def test_shown_the_map_it_walks_the_shortest_way() -> None:
    blind = run(PlannerAgent(OccupancyMapper(41)), flat())
    shown = run(PlannerAgent(OccupancyMapper(41), oracle_inputs=["map"]), flat())
    assert shown["spl"].mean() == pytest.approx(1.0, abs=0.01)
    assert blind["spl"].mean() < shown["spl"].mean()


def test_around_sees_every_heading_before_it_walks_on() -> None:
    frame = run(PlannerAgent(OccupancyMapper(41), look="around"), flat())
    once = run(PlannerAgent(OccupancyMapper(41)), flat())
    # Three turns more a place at the least, and rotations are free.
    assert (frame["actions"] - frame["path_length"]).mean() > 2 * frame["path_length"].mean()
    assert (once["actions"] - once["path_length"]).mean() < once["path_length"].mean() + 2


def test_a_wall_that_it_cannot_see_is_found_by_running_into_it_once() -> None:
    corridor = draw("corridor", "aaaaaaaa\naaaa#aaa\n####aaaA")
    blind = {"local_patch": torch.full((4 * corridor.grid.cells, 5, 5), torch.nan)}
    episodes = exhaustive_episodes(corridor, ["ring"], VAR, seed=0)
    agent = PlannerAgent(OccupancyMapper(41))
    frame = rollout_scene(
        agent, corridor, episodes, VAR, LABELS, SceneObservations(truth(corridor), blind)
    )
    assert frame["success"].mean() > 0.8
    assert 0 < frame["collisions"].mean() < 3


def test_it_holds_to_a_source_that_it_hears_elsewhere_from_each_side() -> None:
    # Facing east it hears the source in the west, facing west in the east: it must not turn for
    # ever.
    hall = draw("hall", "aaaaaaaaA")
    sound = torch.tensor([[0.0, -2.0]]).expand(1, 4 * 9, 1, 1, 2)
    episodes = exhaustive_episodes(hall, ["ring"], VAR, seed=0)
    agent = PlannerAgent(OccupancyMapper(41))
    observed = SceneObservations({"source_estimate": sound}, {"local_patch": windows(hall)})
    frame = rollout_scene(agent, hall, episodes, VAR, LABELS, observed)
    assert frame["actions"].max() < 300
    assert frame["path_length"].min() > 0


def test_it_finds_itself_by_retrieval_and_walks_its_memory() -> None:
    scene = flat()
    rules = dataclasses.replace(VAR, exploration_steps=150)
    known = run(PlannerAgent(MemoryMapper(41), collision_cost=4.0), scene, rules)
    lost = run(
        PlannerAgent(MemoryMapper(41, localisation="retrieval"), collision_cost=4.0), scene, rules
    )
    true = run(
        PlannerAgent(MemoryMapper(41), collision_cost=4.0, oracle_inputs=["pose"]), scene, rules
    )
    assert true["success"].mean() >= known["success"].mean() - 0.05
    assert known["success"].mean() > 0.6
    assert known["spl"].mean() > lost["spl"].mean()
    assert (known["start_cell"].to_numpy() == lost["start_cell"].to_numpy()).all()


def test_without_a_walk_a_memory_is_refused() -> None:
    scene, agent = flat(), PlannerAgent(MemoryMapper(41))
    episodes = exhaustive_episodes(scene, ["ring"], VAR, seed=0)
    with pytest.raises(UserError, match="explores first, and these episodes have no exploration"):
        rollout_scene(
            agent,
            scene,
            episodes,
            VAR,
            LABELS,
            SceneObservations(truth(scene), {"visual_embedding": looks(scene)}),
        )


def test_a_missing_sense_is_named() -> None:
    scene, agent = flat(), PlannerAgent(OccupancyMapper(41))
    episodes = exhaustive_episodes(scene, ["ring"], VAR, seed=0)
    with pytest.raises(UserError, match="needs the observation 'local_patch', which is not there"):
        rollout_scene(agent, scene, episodes, VAR, LABELS, SceneObservations(truth(scene)))
    observed = SceneObservations(
        {"source_estimate": truth(scene)["source_estimate"]}, {"local_patch": windows(scene)}
    )
    with pytest.raises(
        UserError, match="needs the observation 'stop_probability', which is not there"
    ):
        rollout_scene(
            agent, scene, exhaustive_episodes(scene, ["ring"], STOP, 0), STOP, LABELS, observed
        )


def test_settings_that_cannot_work_are_refused() -> None:
    with pytest.raises(UserError, match=r"look: 'twice' is none of once, around"):
        PlannerAgent(OccupancyMapper(), look="twice")
    with pytest.raises(
        UserError,
        match=r"agent.oracle_inputs: 'goal' is none of source_estimate, arrival, local_patch",
    ):
        PlannerAgent(OccupancyMapper(), oracle_inputs=["goal"])
    with pytest.raises(UserError, match=r"planner.obstacle_threshold: 0.7; give 0 to 0.5"):
        PlannerAgent(OccupancyMapper(), obstacle_threshold=0.7)
    with pytest.raises(UserError, match=r"localisation: 'gps' is none of retrieval"):
        MemoryMapper(localisation="gps")


def test_only_who_is_given_the_truth_is_privileged() -> None:
    assert not PlannerAgent(OccupancyMapper()).privileged
    assert PlannerAgent(OccupancyMapper(), oracle_inputs=["local_patch"]).privileged


@pytest.mark.parametrize(("backward", "turns"), [(False, 2), (True, 0)])
def test_what_lies_behind_is_walked_backward_only_where_that_is_allowed(
    backward: bool, turns: int
) -> None:
    corridor = draw("corridor", "Aaaaaaaa")
    episodes = exhaustive_episodes(corridor, ["ring"], VAR, seed=0)
    frame = rollout_scene(
        PlannerAgent(OccupancyMapper(41), backward=backward),
        corridor,
        episodes,
        VAR,
        LABELS,
        SceneObservations(truth(corridor), {"local_patch": windows(corridor)}),
    )
    east = frame[(frame["start_heading"] == 1) & (frame["start_cell"] > 4)]
    assert east["success"].all()
    assert (east["path_length"] == east["start_cell"] - 1).all()  # to the cell beside the source
    assert (east["actions"] - east["path_length"] == turns).all()
