import io
import re

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from avn.reporting.paper import paper_table
from avn.reporting.published import latex, legend, markdown, published, terminal
from avn.reporting.results import EPISODE_COLUMNS


def episodes(seed: int, share: float, agent: str = "greedy") -> pd.DataFrame:
    """Episodes of two rooms and two sounds, of which a share succeeds with an SPL of a half."""
    rows = []
    generator = np.random.default_rng(seed)
    for room in ("room_1", "room_2"):
        for sound in ("ring", "a_b"):
            for number in range(40):
                row = dict.fromkeys(EPISODE_COLUMNS, 0)
                row |= {"agent": agent, "protocol": "var", "acoustics": "resonance", "look": "once"}
                row |= {"scene": room, "sound": sound, "seed": seed, "episode": number}
                row["source"], row["outcome"] = number % 5, "success"
                row["success"] = int(generator.random() < share)
                row["spl"] = row["success"] / 2
                rows.append(row)
    return pd.DataFrame(rows)


@pytest.fixture
def table():
    walked = pd.concat([episodes(0, 0.3), episodes(1, 0.5)])
    return published(walked, {"greedy": ["ring"]}), walked


def test_cells_are_means_over_seeds_beside_the_papers_own(table):
    cells, walked = table
    one = cells[(cells["scene"] == "room_1") & (cells["sound"] == "ring")].iloc[0]
    own = walked[(walked["scene"] == "room_1") & (walked["sound"] == "ring")]
    assert one["sr"] == pytest.approx(100 * own["success"].mean())
    assert one["spl"] == pytest.approx(50 * own["success"].mean())
    each = own.groupby("seed")["success"].mean()
    assert one["sr_std"] == pytest.approx(100 * each.std(ddof=1))
    assert one["sr_low"] < one["sr"] < one["sr_high"]
    assert np.isnan(one["paper_sr"])  # the paper's first room is not ours
    average = cells[(cells["scene"] == "average") & (cells["sound"] == "ring")].iloc[0]
    paper = paper_table().set_index(["agent", "sound", "scene"]).loc[("greedy", "ring", "average")]
    assert (average["paper_sr"], average["paper_spl"]) == (paper["sr"], paper["spl"])


def test_the_average_is_that_of_the_rooms(table):
    cells, _ = table
    ring = cells[cells["sound"] == "ring"].set_index("scene")["sr"]
    assert ring["average"] == pytest.approx(ring[["room_1", "room_2"]].mean())


def test_a_cell_has_its_interval_its_spread_and_the_papers_own(table):
    cells, _ = table
    one = cells[(cells["scene"] == "room_1") & (cells["sound"] == "ring")].iloc[0]
    lines = [
        f"{one['sr']:.1f} / {one['spl']:.1f}",
        f"{one['sr_low']:.0f}-{one['sr_high']:.0f} / {one['spl_low']:.0f}-{one['spl_high']:.0f}",
        f"{one['sr_std']:.1f} / {one['spl_std']:.1f}",
    ]
    stacked = "{}<br>[{}]<br>± {}".format(*lines)
    assert f"| `greedy` | {stacked} | " in markdown(cells, ["ring", "a_b"])
    assert "<br>(12.4 / 11.1) |" in markdown(cells, ["ring", "a_b"])  # of the average
    # an empty group, or LaTeX takes the bracket for the length that may follow a line's end
    assert " \\\\{} ".join((lines[0], f"[{lines[1]}]")) in latex(cells, ["ring", "a_b"])
    console = Console(file=io.StringIO(), width=120)
    console.print(terminal(cells, ["greedy"]))
    shown = console.file.getvalue().splitlines()
    first = next(n for n, line in enumerate(shown) if line.startswith("  ring"))
    assert "acoustics=resonance" in " ".join(shown[:3])
    assert shown[first - 1].strip() == "greedy (upper bound)"
    assert "12.4 / 11.1" in next(line for line in shown if "Gan et al. 2020" in line)
    names = ("ring", "95 %", "± over seeds")
    for name, own, line in zip(names, lines, shown[first:], strict=False):
        assert line.strip().startswith(name)
        assert line.strip().removeprefix(name).strip().startswith(own)


def test_a_full_table_fits_into_a_pipe():
    walked = episodes(0, 1.0, agent="ours_exp-true-pose")
    rooms = [walked.assign(room=f"room_{n}", seed=s) for n in range(1, 6) for s in (0, 1)]
    cells = published(pd.concat(rooms))
    console = Console(file=io.StringIO(), width=120)
    console.print(terminal(cells, ["ours_exp-true-pose"]))
    shown = console.file.getvalue()
    assert "…" not in shown
    assert "100.0 / 50.0" in shown


def test_one_seed_has_no_spread_and_an_agent_of_ones_own_no_paper():
    walked = episodes(0, 0.3, agent="mine")
    cells = published(walked)
    text = markdown(cells, ["ring", "a_b"])
    line = next(line for line in text.splitlines() if line.startswith("| `mine`"))
    assert line.count("|") == 5
    assert line.count("[") == 2  # two apartments are too few for an average
    assert "±" not in line
    assert "(" not in line


def test_latex_escapes_names_and_has_as_many_cells_as_columns(table):
    cells, _ = table
    text = latex(cells, ["ring", "a_b"])
    assert r"a\_b" in text
    lines = [line for line in text.splitlines() if "&" in line]
    assert {line.count("&") for line in lines} == {4}
    assert not re.search(r"\bnan\b", text, re.IGNORECASE)


def test_the_papers_figures_stand_where_they_belong_alone():
    walked = pd.concat([episodes(0, 0.3), episodes(1, 0.5)])
    cells = published(walked)
    assert cells["paper_sr"].isna().all()
    text = markdown(cells, ["ring", "a_b"], caption="protocol var with max_moves_ratio=3.0")
    assert "paper" not in text
    assert "Protocol var with max_moves_ratio=3.0." in text
    own = published(walked, {"greedy": ["ring"]})
    assert set(own.loc[own["paper_sr"].notna(), "sound"]) == {"ring"}
    assert "the results of the paper" in markdown(own, ["ring", "a_b"])


def test_what_has_no_interval_is_said():
    walked = episodes(0, 0.3).query("source < 2")
    cells = published(walked)
    for text in (markdown(cells, ["ring", "a_b"]), latex(cells, ["ring", "a_b"], caption="a_b")):
        assert "too few sources (fewer than 5), for an interval" in text
        assert "[" not in text
    assert r"\footnotesize a\_b" in latex(cells, ["ring", "a_b"], caption="a_b")


def test_several_networks_have_a_line_of_their_own():
    walked = pd.concat(
        [
            episodes(seed, share, agent="mine").assign(train_seed=network)
            for network, share in enumerate((0.3, 0.5, 0.7))
            for seed in (0, 1)
        ]
    )
    cells = published(walked)
    row = cells[(cells["scene"] == "average") & (cells["sound"] == "all")].iloc[0]
    spread = 100 * walked.groupby("train_seed")["success"].mean().std()
    assert row["sr_network_std"] == pytest.approx(spread)
    assert f"± {spread:.1f} / {row['spl_network_std']:.1f} over networks" in markdown(
        cells, ["ring", "a_b"]
    )
    assert "the standard deviation over 3 networks" in legend(cells)
    console = Console(file=io.StringIO(), width=120)
    console.print(terminal(cells))
    assert "± over networks" in console.file.getvalue()


def test_the_interval_says_what_is_resampled():
    rooms = [episodes(0, 0.5).replace({"room_1": f"a_{n}", "room_2": f"b_{n}"}) for n in range(3)]
    cells = published(pd.concat(rooms))
    assert cells["sr_low"].notna().all()
    for text in (legend(cells), markdown(cells, ["ring", "a_b"]), latex(cells, ["ring", "a_b"])):
        assert "95 %, apartments, sources and episodes resampled" in text
        assert "of this apartment only" in text
