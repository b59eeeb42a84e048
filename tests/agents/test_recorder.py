import numpy as np
import pytest
import torch
from drawn_walks import TAKES, flat, hearing, ours, simulator, walked
from tensordict import TensorDict
from torch import Tensor

from avn.agents.greedy import Greedy
from avn.agents.random_walk import RandomWalk
from avn.agents.recorder import Recorder
from avn.agents.rollout import rollout
from avn.core.actions import transitions
from avn.mapping.memory_mapper import MemoryMapper


def test_a_trace_is_the_walk_that_the_records_tell_of() -> None:
    for trace in walked(Greedy()):
        record, state = trace.record, trace.state
        table = transitions(trace.scene.grid.neighbours)
        assert (table[state[:-1], trace.action] == state[1:]).all()
        assert (state[0] // 4, state[0] % 4) == (record["start_cell"], record["start_heading"])
        assert state[-1] // 4 == record["end_cell"]
        assert len(trace.action) == record["actions"]
        assert trace.collided.sum() == record["collisions"]
        assert trace.goal.tolist() == trace.scene.grid.centres[record["source_cell"]].tolist()
        # Its ears are perfect here.
        assert trace.source_estimates is not None
        np.testing.assert_allclose(
            trace.source_estimates, np.tile(trace.goal, (len(state), 1)), atol=1e-5
        )
        assert trace.beliefs is None
        assert trace.exploration_trajectory is None


def test_the_takes_are_those_that_the_simulator_lets_hear() -> None:
    scene = flat()
    # what is heard tells which take it is
    realisations = (
        torch.arange(TAKES).float().expand(len(scene.sources), 4 * scene.grid.cells, 1, -1)
    )
    world = simulator(scene, torch.stack((realisations, torch.zeros_like(realisations)), dim=-1))
    told: list[Tensor] = []

    class Ears(RandomWalk):
        def act(self, observation: TensorDict) -> Tensor:
            told.append(observation["source_estimate"][:, 0])
            return super().act(observation)

    recorder = Recorder({"flat": [1, 4]}, TAKES, beliefs=False)
    rollout(Ears(), world, recorder)
    for row in (1, 4):
        trace = recorder.trace("flat", row, {})
        takes = [int(step[row]) for step in told[: len(trace.action)]]
        assert trace.realisation[:-1].tolist() == takes
        assert len(set(takes)) > 1


@pytest.mark.parametrize(
    ("explores", "localisation"),
    [(False, ""), (True, "retrieval"), (True, "retrieval+odometry")],
)
def test_beliefs_lie_where_the_apartment_lies(explores: bool, localisation: str) -> None:
    agent = ours(explores, localisation) if explores else ours()
    traces = walked(agent)
    assert len({trace.state[0] % 4 for trace in traces}) > 1  # from starts that look elsewhere
    for trace in traces:
        beliefs = trace.beliefs
        assert beliefs is not None
        assert beliefs.free is not None
        squares = trace.scene.grid.lattice - beliefs.low
        free = np.zeros(beliefs.free.shape[1:], dtype=bool)
        free[squares[:, 1], squares[:, 0]] = True
        for step, belief in enumerate(beliefs.free):
            x, y = trace.scene.grid.lattice[trace.state[step] // 4] - beliefs.low
            if localisation != "retrieval":
                assert belief[y, x] == 255
            if not explores:  # what it saw is true
                assert free[belief > 200].all()
                assert not free[belief < 50].any()
        if localisation != "retrieval":
            np.testing.assert_allclose(beliefs.pose[:, :2], trace.path[:-1])
            assert (beliefs.pose[:, 2] == trace.state[:-1] % 4).all()


def test_the_posterior_comes_to_lie_on_the_source() -> None:
    for trace in walked(hearing()):
        beliefs = trace.beliefs
        assert beliefs is not None
        assert beliefs.posterior is not None
        assert beliefs.posterior.shape == beliefs.free.shape
        assert beliefs.posterior[-1].max() == 255  # at first it may lie outside the apartment
        y, x = np.unravel_index(beliefs.posterior[-1].argmax(), beliefs.posterior.shape[1:])
        source = trace.scene.grid.lattice[trace.scene.sources[trace.source]] - beliefs.low
        assert np.abs(source - (x, y)).max() <= 1
    plain = walked(ours(), [0])[0].beliefs
    assert plain is not None
    assert plain.posterior is None


def test_the_memory_returns_the_very_place_where_it_was_before() -> None:
    seen = 0
    for trace in walked(ours(explores=True)):
        beliefs = trace.beliefs
        assert trace.exploration_trajectory is not None
        assert beliefs is not None
        assert beliefs.similarity is not None
        assert beliefs.retrieved is not None
        for step in np.flatnonzero(np.isin(trace.state[:-1], trace.exploration_trajectory)):
            assert beliefs.similarity[step, 0] == 1
            assert beliefs.retrieved[step, 0, :2].tolist() == trace.path[step].tolist()
            assert beliefs.retrieved[step, 0, 2] == trace.state[step] % 4
            seen += 1
    assert seen


def test_who_looks_on_changes_nothing_and_may_leave_early() -> None:
    watched, alone = simulator(flat()), simulator(flat())
    rollout(ours(), alone)
    recorder = Recorder({"flat": [0, 1]}, TAKES, beliefs=True)
    calls = 0

    def watch(*step: object) -> bool:
        nonlocal calls
        calls += 1
        return recorder(*step)  # type: ignore[arg-type]

    rollout(ours(), watched, watch)
    assert (watched.state[:2] == alone.state[:2]).all()
    assert (watched.actions[:2] == alone.actions[:2]).all()
    assert calls <= int(alone.actions.max()) + 1
    other = simulator(flat())
    rollout(ours(), other, Recorder({"elsewhere": [0]}, TAKES, beliefs=True))
    assert not other.actions.any()


def test_a_mapper_without_pictures_of_its_beliefs_is_left_out() -> None:
    class Blind(MemoryMapper):
        def belief(self, rows: Tensor) -> None:  # type: ignore[override]
            return None

    agent = ours(explores=True)
    agent.mapper = Blind(41)
    trace = walked(agent, [2])[0]
    assert trace.beliefs is not None
    assert trace.beliefs.free is None
    assert trace.beliefs.retrieved is not None
