"""`avn.reproduce table=conditions`, on the real pipeline with agents that need no network."""

from pathlib import Path

import pandas as pd
import pytest
from small import composed

from avn.pipeline.condition_table import _caption
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


def test_the_heading_names_what_the_agents_do_and_whose_networks_they_have():
    looking = [composed("agent=belief", "acoustics=diffraction", "look=around")]
    assert "; look around; test apartments of var" in _caption(looking)
    package = composed("agent=belief", "acoustics=diffraction", "networks=published")
    assert _caption([package]).endswith("networks published with the package")
    assert "look" not in _caption([package])
    learns_nothing = composed("agent=random_walk", "acoustics=diffraction")
    assert "networks" not in _caption([learns_nothing])


@pytest.mark.parametrize(
    ("given", "named"),
    [("conditions=loud", "condition"), ("rows=[]", "rows: empty")],
)
def test_what_cannot_work_is_one_line(command, tmp_path, given, named):
    usual = "conditions=heard" if given.startswith("rows") else "rows=random_walk"
    code, _, err = command("reproduce", "table=conditions", usual, given, f"outputs={tmp_path}")
    assert code == 2
    assert len(err) == 1
    assert named in err[0]
