import pandas as pd
import pytest
from rich.console import Console

from avn.reporting.perception_tables import (
    arrivals_table,
    local_patches_table,
    localisation_table,
    source_estimates_table,
)


def lines(table) -> list[str]:
    console = Console(width=120)
    with console.capture() as capture:
        console.print(table)
    return [" ".join(line.split()) for line in capture.get().splitlines() if line.strip()]


def test_what_is_heard_is_the_mean_of_the_rooms():
    row = {"sound": "alarm", "sight": "in_sight", "bearing_deg": 10.0, "front_back": 0.25}
    source_estimates = pd.DataFrame([{**row, "error_m": 1.0}, {**row, "error_m": 2.0}])
    assert lines(source_estimates_table(source_estimates))[-1] == "alarm, in sight 1.50 10 25 %"


def test_arrivals_are_the_mean_of_the_rooms():
    row = {"sight": "out_of_sight", "clips": 9, "behind": 0.1, "log_length": 0.25}
    arrivals = pd.DataFrame([{**row, "arrival_deg": 10.0}, {**row, "arrival_deg": 20.0}])
    assert lines(arrivals_table(arrivals))[-1] == "out of sight 15 10 % 0.25"


def test_windows_are_those_of_all_rooms():
    row = {"by": "network", "cells": "visible", "ece": 0.0131, "loss": 0.3, "accuracy": 0.9}
    seen = pd.DataFrame([{**row, "scene": "a", "auc": 0.5}, {**row, "scene": "all", "auc": 0.9512}])
    found = lines(local_patches_table(seen))
    assert found[-1] == "network, visible cells 0.951 90.0 % 0.013"
    assert len(found) == 3  # title, head, one row


@pytest.mark.parametrize(("second", "shown"), [(2.0, "1.50"), (float("nan"), "1.00")])
def test_places_are_the_mean_of_the_rooms_that_have_any(second, shown):
    row = {"cells": "walked", "views": 4, "error_mean_m": 2.0, "heading": 0.5}
    places = pd.DataFrame([{**row, "error_m": 1.0}, {**row, "error_m": second}])
    assert lines(localisation_table(places))[-1] == f"walked cells {shown} 2.00 50 %"
