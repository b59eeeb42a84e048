"""Table of conditions: means by hand, intervals, order, and cells that are missing."""

import numpy as np
import pandas as pd
import pytest
from made_runs import records

from avn.reporting.condition_table import condition_cells, markdown
from avn.reporting.results import DYNAMIC_METRICS


@pytest.fixture
def episodes():
    random = np.random.default_rng(0)
    parts = []
    for agent in ("belief", "greedy"):
        for condition, share in (("heard", 0.8), ("unheard", 0.4)):
            for network in (0, 1, 2):
                own = records()
                own["agent"] = agent
                own["success"] = (random.random(len(own)) < share).astype(int)
                own["spl"] = 0.5 * own["success"]
                parts.append(own.assign(condition=condition, train_seed=network))
    return pd.concat(parts, ignore_index=True)


def test_a_cell_is_the_mean_over_scenes_and_networks_of_all_sounds(episodes):
    cells = condition_cells(episodes).set_index(["agent", "condition"])
    own = episodes[(episodes["agent"] == "belief") & (episodes["condition"] == "unheard")]
    by_hand = 100 * own.groupby("scene")["success"].mean().mean()
    row = cells.loc[("belief", "unheard")]
    assert row["sr"] == pytest.approx(by_hand)
    assert row["spl"] == pytest.approx(by_hand / 2)
    assert row["networks"] == 3
    assert row["episodes"] == len(own) / 3
    networks = 100 * own.groupby(["train_seed", "scene"])["success"].mean().groupby(level=0).mean()
    assert row["sr_network_std"] == pytest.approx(networks.std(ddof=1))
    assert row["sr_low"] < row["sr"] < row["sr_high"]


def test_the_text_keeps_the_order_and_says_where_a_cell_is_missing(episodes):
    cells = condition_cells(episodes[episodes["agent"] != "greedy"])
    text = markdown(cells, ["unheard", "heard"], ["greedy", "belief"]).splitlines()
    assert text[0] == "| condition | `greedy` | `belief` |"
    assert [line.split("|")[1].strip() for line in text[2:]] == ["`unheard`", "`heard`"]
    assert all(line.split("|")[2].strip() == "-" for line in text[2:])


def test_a_moving_source_has_dynamic_spl_and_the_distance_that_is_left(episodes):
    moving = episodes["condition"] == "unheard"
    episodes["dspl"] = (0.25 * episodes["success"]).where(moving)
    episodes["ndtg"] = (1.0 - 0.9 * episodes["success"]).where(moving)
    cells = condition_cells(episodes)
    row = cells.set_index(["agent", "condition"]).loc[("belief", "unheard")]
    assert row["dspl"] == pytest.approx(row["sr"] / 4)
    assert row["ndtg"] == pytest.approx(100 - 0.9 * row["sr"])
    lines = markdown(cells, ["heard", "unheard"], ["belief"]).splitlines()[2:]
    assert "DSPL" not in lines[0]
    assert f"DSPL, %: {row['dspl']:.1f}" in lines[1]
    assert f"NDTG, %: {row['ndtg']:.1f}" in lines[1]


def test_every_metric_of_a_changing_world_is_in_the_table(episodes):
    for column in DYNAMIC_METRICS.values():
        episodes[column] = 0.5
    assert {*DYNAMIC_METRICS} <= {*condition_cells(episodes)}


def test_a_condition_in_which_something_changes_has_further_lines(episodes):
    silent = episodes["condition"] == "unheard"
    first = episodes["start_cell"] % 2 == 0
    episodes["success_when_silent"] = (episodes["success"] * first).where(silent)
    cells = condition_cells(episodes)
    plain = condition_cells(episodes.drop(columns="success_when_silent"))
    pd.testing.assert_frame_equal(cells[plain.columns], plain)
    row = cells.set_index(["agent", "condition"])["sws"]
    own = episodes[silent & (episodes["agent"] == "belief")]
    by_hand = 100 * own.groupby("scene")["success_when_silent"].mean().mean()
    assert row["belief", "unheard"] == pytest.approx(by_hand)
    assert np.isnan(row["belief", "heard"])
    lines = markdown(cells, ["heard", "unheard"], ["belief"]).splitlines()[2:]
    assert "SWS" not in lines[0]
    assert f"SWS, %: {by_hand:.1f}" in lines[1]
