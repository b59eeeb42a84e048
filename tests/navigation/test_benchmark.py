"""The frozen benchmark, walked: as hard as the paper's, and solvable."""

import numpy as np
import pandas as pd
import pytest
from small import opened

from avn.acoustics.settings import AcousticsConfig
from avn.agents.oracle import Oracle
from avn.agents.random_walk import RandomWalk
from avn.agents.rollout import Labels, rollout_scene
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import load_split
from avn.navigation.episodes import exhaustive_episodes, frozen_episodes
from avn.navigation.protocols import Protocol
from avn.reporting.results import headline, summarise

PROTOCOLS = {
    "var": Protocol(
        "var", goal="box", requires_stop=False, path_length="moves", max_moves_ratio=2.0
    ),
    "var_stop": Protocol(
        "var_stop", goal="box", requires_stop=True, path_length="moves", max_moves_ratio=2
    ),
    "stop": Protocol("stop", goal="radius", requires_stop=True, path_length="metres"),
}


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    folder = tmp_path_factory.mktemp("var")
    plans = load_split(SplitConfig(folder="var"))["test"]
    return [opened(plan, AcousticsConfig(), folder) for plan in plans]


def walked(agent, rooms, protocol, episodes):
    labels = Labels(agent="agent", acoustics="resonance")
    records = [
        rollout_scene(agent, room, episodes(room, ["ring"], protocol, 0), protocol, labels)
        for room in rooms
    ]
    return headline(summarise(pd.concat(records, ignore_index=True), draws=10))


def test_random_search_is_as_in_the_paper(rooms):
    figures = walked(RandomWalk(), rooms, PROTOCOLS["var"], exhaustive_episodes)
    assert 100 * figures["sr"] == pytest.approx(7.1, abs=1.5)
    assert 100 * figures["spl"] == pytest.approx(4.3, abs=1.0)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_the_oracle_never_fails_and_never_walks_too_far(rooms, name):
    figures = walked(Oracle(), rooms, PROTOCOLS[name], frozen_episodes)
    found = np.array([figures["sr"], figures["spl"], figures["sna"], figures["sna_goal"]])
    np.testing.assert_allclose(found, 1.0)
