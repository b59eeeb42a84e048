import pandas as pd
import pytest
from rich.console import Console

from avn.reporting.paper import PAPER_SOUNDS, paper_averages, paper_results, paper_table
from avn.reporting.results import RESULT_COLUMNS
from avn.reporting.table import hardness, print_tables

WHOLE = (*PAPER_SOUNDS, "all")


def results(agent: str, protocol: str = "var") -> pd.DataFrame:
    rows = [
        (agent, protocol, "resonance", "once", sound, room, 0, 100, sr, sr / 2)
        for sound, sr in (("ring", 0.0625), ("all", 1.0))
        for room in ("room_1", "room_2", "average")
    ]
    return pd.DataFrame(rows, columns=list(RESULT_COLUMNS[:10])).reindex(
        columns=list(RESULT_COLUMNS), fill_value=0.0
    )


def episodes() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "scene": ["room_1", "room_1", "room_2"],
            "rooms_crossed": [0, 2, 1],
            "in_sight": [1, 0, 1],
            "geodesic": [2.0, 6.0, 4.0],
            "euclidean": [2.0, 3.0, 4.0],
        }
    )


def printed(table: pd.DataFrame, **options) -> list[str]:
    """The lines that the terminal shows, without blanks at either end."""
    console = Console(width=120, force_terminal=False)
    with console.capture() as capture:
        print_tables(table, episodes(), console, **options)
    return [line.strip() for line in capture.get().splitlines()]


def cells(lines: list[str], first: str) -> list[list[str]]:
    """The cells behind a row's first one, for all rows that begin so."""
    return [line[len(first) :].split() for line in lines if line.startswith(first)]


def test_table_has_a_row_for_each_sound_and_a_column_for_each_room() -> None:
    lines = printed(results("greedy"))
    assert lines[1].split() == ["Room", "1", "Room", "2", "Average"]
    assert "greedy · var · resonance" in lines
    assert cells(lines, "ring") == [["6.2/3.1"] * 3]
    assert cells(lines, "all") == [["100/50.0"] * 3]


def test_metrics_of_episodes_that_change_follow_over_all_sounds() -> None:
    table = results("belief").assign(sws=0.25, drift=1.5, dsr=float("nan"))
    table.loc[table["sound"] == "ring", "sws"] = 0.75
    lines = printed(table)
    assert cells(lines, "SWS, %") == [["25.0"] * 3]
    assert cells(lines, "drift, m") == [["1.5"] * 3]
    assert not cells(lines, "DSR, %"), "no episode has a distractor"
    assert not cells(printed(results("belief")), "SWS, %")


def test_the_papers_own_figures_stand_below_ours() -> None:
    lines = printed(results("greedy"), paper={"greedy": WHOLE})
    assert cells(lines, "Gan et al. 2020") == [
        ["12.4/11.1"],
        ["11.7/10.4"],
    ]
    order = [line.split()[0] for line in lines if line][2:7]
    assert order == ["greedy", "ring", "Gan", "all", "Gan"]


def test_no_figures_of_the_paper_where_it_has_none_or_they_do_not_belong() -> None:
    assert cells(printed(results("oracle"), paper={"oracle": WHOLE}), "Gan et al. 2020") == []
    assert cells(printed(results("greedy")), "Gan et al. 2020") == []
    assert cells(printed(results("greedy"), paper={"greedy": ()}), "Gan et al. 2020") == []
    lines = printed(results("greedy"), paper={"greedy": ("ring",)})
    assert [line.split()[0] for line in lines if line][2:6] == ["greedy", "ring", "Gan", "all"]


def test_each_table_has_its_world_below_its_heading() -> None:
    lines = printed(results("greedy"), caption="acoustics diffraction; protocol stop")
    heads = [n for n, line in enumerate(lines) if line.startswith(("success rate", "difficulty"))]
    assert len(heads) == 2
    assert all(lines[n + 1] == "acoustics diffraction; protocol stop" for n in heads)


def test_one_apartment_has_no_average() -> None:
    table = results("greedy").query("scene != 'room_2'")
    assert printed(table)[1].split() == ["Room", "1"]
    assert hardness(episodes().query("scene == 'room_1'"))["scene"].tolist() == ["room_1"]


def test_the_papers_average_is_over_its_three_sounds_alone() -> None:
    averages = paper_averages({"greedy": WHOLE, "ours_exp": ("ring",), "mine": WHOLE})
    assert list(averages) == ["greedy"]
    assert averages["greedy"] == pytest.approx((11.7, 10.4), abs=0.06)
    assert set(paper_results({"greedy": ("ring",)})["sound"]) == {"ring"}


def test_hardness_by_hand() -> None:
    table = hardness(episodes()).set_index("scene")
    assert table.loc["room_1"].to_dict() == {
        "episodes": 2,
        "other_room": 0.5,
        "out_of_sight": 0.5,
        "detour": 1.5,
        "geodesic": 4.0,
    }
    # The average counts both rooms the same, and all episodes.
    assert table.loc["average"].to_dict() == {
        "episodes": 3,
        "other_room": 0.75,
        "out_of_sight": 0.25,
        "detour": 1.25,
        "geodesic": 4.0,
    }


def test_hardness_is_printed() -> None:
    assert cells(printed(results("greedy")), "Average") == [
        ["3", "75", "%", "25", "%", "1.25", "4.0", "m"]
    ]


def test_paper_table_is_whole_and_its_averages_are_means_over_rooms() -> None:
    table = paper_table()
    assert len(table) == 9 * 3 * 6
    wide = table.pivot_table(index=["agent", "sound"], columns="scene", values=["sr", "spl"])
    assert not wide.isna().any().any()
    rooms = [f"room_{number}" for number in range(1, 6)]
    for figure in ("sr", "spl"):
        gap = (wide[figure][rooms].mean(axis=1) - wide[figure]["average"]).abs()
        assert gap.max() < 0.3
        assert (gap <= 0.1).mean() > 0.9


@pytest.mark.parametrize(
    ("agent", "sr", "spl"),
    [
        ("random_walk", 7.1, 4.3),
        ("greedy", 11.7, 10.4),
        ("a3c_va_m_mapper", 33.7, 23.4),
        ("ours_noexp", 58.7, 39.1),
        ("ours_exp", 69.3, 51.6),
    ],
)
def test_paper_averages_over_its_sounds(agent: str, sr: float, spl: float) -> None:
    table = paper_table()
    average = table[(table["agent"] == agent) & (table["scene"] == "average")]
    assert average["sr"].mean() == pytest.approx(sr, abs=0.06)
    assert average["spl"].mean() == pytest.approx(spl, abs=0.06)
