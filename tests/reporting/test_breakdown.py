import pandas as pd
import pytest

from avn.core.errors import UserError
from avn.reporting.breakdown import breakdown, breakdown_figure


def episodes() -> pd.DataFrame:
    """Near ones in sight succeed, far ones behind doorways do not."""
    return pd.DataFrame(
        {
            "scene": ["a", "a", "b", "b", "b"],
            "source": [0, 1, 0, 1, 2],
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
    assert (table["sr_low"] <= table["sr"]).all()
    assert (table["sr"] <= table["sr_high"]).all()
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
