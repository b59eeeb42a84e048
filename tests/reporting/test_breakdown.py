import numpy as np
import pandas as pd
import pytest

from avn.core.errors import UserError
from avn.reporting.breakdown import KINDS, breakdown, breakdown_figure


def episodes() -> pd.DataFrame:
    """Near ones in sight succeed, far ones behind doorways do not."""
    return pd.DataFrame(
        {
            "scene": ["a", "a", "b", "b", "b"],
            "source": [0, 1, 0, 1, 2],
            "seed": 0,
            "episode": [0, 1, 0, 1, 2],
            "sound": "ring",
            "geodesic": [1.0, 2.0, 5.5, 11.0, 12.0],
            "in_sight": [1, 1, 0, 0, 0],
            "rooms_crossed": [0, 0, 1, 3, 4],
            "success": [1, 1, 1, 0, 0],
            "spl": [1.0, 0.5, 0.5, 0.0, 0.0],
        }
    )


def test_groups_hold_their_own_episodes_in_order() -> None:
    table = breakdown(episodes(), "distance")
    assert table["group"].tolist() == ["0 to 2", "2 to 4", "4 to 6", "10 or more"]
    assert table["episodes"].tolist() == [1, 1, 1, 2]
    assert table["spl"].tolist() == [1.0, 0.5, 0.5, 0.0]
    table = breakdown(episodes(), "sight")
    assert table["group"].tolist() == ["in sight", "out of sight"]
    assert table["sr"].tolist() == pytest.approx([1, 1 / 3])
    assert table["sr_low"].isna().all()  # of two and three sources
    table = breakdown(episodes(), "rooms")
    assert table["group"].tolist() == ["0", "1", "3 or more"]
    assert table["episodes"].tolist() == [2, 1, 2]


def test_another_kind_is_refused() -> None:
    with pytest.raises(UserError, match="'size' is none of distance, sight, rooms"):
        breakdown(episodes(), "size")


def test_runs_stand_side_by_side() -> None:
    other = episodes().assign(success=0, spl=0.0)
    figure = breakdown_figure({"one": episodes(), "other": other})
    first = figure.axes[0]
    rates = [box.lines[0].get_ydata().tolist() for box in first.containers]
    assert rates == [[100, 100, 100, 0], [0, 0, 0, 0]]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["one", "other"]


def test_groups_and_counts_are_those_of_all_runs():
    near = episodes().query("geodesic < 5")
    far = pd.concat([episodes().query("geodesic > 5")] * 2)
    figure = breakdown_figure({"near": near, "far": far}, caption="mini is for trying")
    first, below = figure.axes[0], figure.axes[len(KINDS)]
    labels = [text.get_text().replace("\n", " ") for text in below.get_xticklabels()]
    assert labels == [
        "0 to 2 0 to 1 episode per run",
        "2 to 4 0 to 1 episode per run",
        "4 to 6 0 to 2 episodes per run",
        "10 or more 0 to 4 episodes per run",
    ]
    rates = [box.lines[0].get_ydata() for box in first.containers]
    assert np.isnan(rates[0]).tolist() == [False, False, True, True]
    assert np.isnan(rates[1]).tolist() == [True, True, False, False]
    assert "mini is for trying" in figure.get_supxlabel()
    alone = breakdown_figure({"far": far}).axes[len(KINDS)]
    assert [text.get_text() for text in alone.get_xticklabels()] == [
        "4 to 6\n2 episodes",
        "10 or more\n4 episodes",
    ]
