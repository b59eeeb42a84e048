"""`avn.reproduce table=conditions`, on the real pipeline with agents that need no network."""

from pathlib import Path

import pandas as pd
import pytest
from small import composed

from avn.config.defaults import default_config
from avn.pipeline.condition_table import _caption, changed_in
from avn.reporting.world import TRIAL_NOTE

SMALL = ("split=mini", "protocol.num_starts=4", "rows=random_walk,oracle", "train_seeds=0")


def test_rows_and_conditions_are_evaluated_and_written(command, tmp_path):
    arguments = ("table=conditions", *SMALL, "conditions=heard,noise_white_10")
    code, out, err = command("reproduce", *arguments, f"outputs={tmp_path}")
    assert code == 0, err
    folder = Path(out[-1])
    planned = [line for line in out if line.startswith("to make: run of ")]
    assert len(planned) == 4
    for row, condition in (("random_walk", "heard"), ("oracle", "noise_white_10")):
        assert sum(f"run of '{row} {condition}' (seed 0, " in line for line in planned) == 1
    cells = pd.read_csv(folder / "cells.csv").set_index(["agent", "condition"])
    assert set(cells.index) == {
        (row, condition)
        for row in ("random_walk", "oracle")
        for condition in ("heard", "noise_white_10")
    }
    assert (cells["acoustics"] == "diffraction").all(), "the hard world, unless another is given"
    assert (cells.loc["oracle", ["sr", "spl"]] == 100).all(axis=None)
    # neither hears, and all conditions have the same starts
    assert cells.loc[("random_walk", "heard"), "sr"] == pytest.approx(
        cells.loc[("random_walk", "noise_white_10"), "sr"]
    )
    text = (folder / "table.md").read_text()
    assert "`noise_white_10`" in text
    assert "one sound an episode" in text
    assert TRIAL_NOTE in text
    assert any(TRIAL_NOTE in line for line in out), "the figures of mini mean nothing"


def caption(*overrides, condition="heard"):
    """Return the caption of a table with one cell."""
    cell = composed(f"condition={condition}", "acoustics=diffraction", *overrides)
    row = str(cell.agent.name)
    return _caption([cell], changed_in({(row, condition): cell}, default_config))


def test_the_heading_names_what_the_agents_do_and_whose_networks_they_have():
    assert "; look around; test apartments of var" in caption("agent=belief", "look=around")
    assert caption("agent=belief", "networks=published").endswith("published with the package")
    assert "look" not in caption("agent=belief")
    assert "networks" not in caption("agent=random_walk")


@pytest.mark.parametrize("condition", ["noise_household_10", "silence", "other_head", "moving"])
def test_the_heading_names_each_setting_that_is_not_that_of_the_row_or_the_condition(condition):
    assert " with " not in caption("agent=belief", "protocol=stop", condition=condition)
    changed = caption(
        "agent=belief",
        "protocol=stop",
        "protocol.num_starts=2",
        "planner.stop_above=0.4",
        "microphone.noise_rms=0",
        "acoustics.rays=100",
        condition=condition,
    )
    assert "protocol stop with num_starts=2;" in changed
    assert "rays=100" in changed.split(";")[0]
    assert "planner.stop_above=0.4" in changed
    assert "microphone.noise_rms=0" in changed


@pytest.mark.parametrize(
    ("condition", "given"),
    [
        ("heard", "odometry=noisy"),
        ("silence", "schedule=continuous"),
        ("unheard", "motion=walking"),
        ("unheard", "sound=ring"),
        ("unheard", "episodes=frozen"),
    ],
)
def test_an_option_in_place_of_that_of_the_condition_is_named(condition, given):
    assert f"with {given}" in caption("agent=belief", given, condition=condition)


def test_settings_of_one_row_or_one_condition_are_named_too():
    world = ("acoustics=diffraction", "protocol=stop")
    cells = {
        ("random_walk", "heard"): composed("agent=random_walk", "condition=heard", *world),
        ("greedy", "heard"): composed("agent=greedy", "condition=heard", *world),
        ("greedy", "silence"): composed(
            "agent=greedy", "condition=silence", *world, "schedule.mean=3"
        ),
    }
    assert changed_in(cells, default_config) == {"schedule.mean": "3.0"}


def test_a_condition_without_a_cell_is_said_and_has_a_row(command, tmp_path):
    asked = ("table=conditions", *SMALL, "conditions=heard,distractor_told", "train_seeds=0")
    code, out, err = command("reproduce", *asked, f"outputs={tmp_path}")
    assert code == 0, err
    said = "distractor_told: no cell for random_walk, oracle, which cannot be told a category"
    assert said in out
    assert "| `distractor_told` | - | - |" in (Path(out[-1]) / "table.md").read_text()


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ("conditions=loud", "condition"),
        ("rows=[]", "rows: empty"),
        ("conditions=", "conditions: empty"),
        ("conditions=distractor_told", "rows: no sound network of random_walk can be told"),
    ],
)
def test_what_cannot_work_is_one_line(command, tmp_path, given, named):
    usual = "conditions=heard" if given.startswith("rows") else "rows=random_walk"
    code, _, err = command("reproduce", "table=conditions", usual, given, f"outputs={tmp_path}")
    assert code == 2
    assert len(err) == 1
    assert named in err[0]
