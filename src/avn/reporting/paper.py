"""Results of the paper, to print beside those of its benchmark."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from importlib import resources

import pandas as pd

from avn.reporting.results import ALL_SOUNDS, AVERAGE

PAPER = "Gan et al. 2020"
# Names of the paper's sounds.
PAPER_SOUNDS = ("ring", "alarm", "clock")


def paper_table() -> pd.DataFrame:
    """Read the results of the paper in long form: agent, sound, scene, sr, spl, both in %.

    Gan, Zhang, Wu, Gong and Tenenbaum, "Look, Listen, and Act: Towards Audio-Visual Embodied
    Navigation", ICRA 2020, table I. Its scenes are other apartments of the same size.
    """
    file = resources.files("avn") / "assets" / "paper_table.csv"
    with file.open(encoding="utf-8") as lines:
        return pd.read_csv(lines)


def paper_results(sounds: Mapping[str, Collection[str]]) -> pd.DataFrame:
    """Return the paper's averages for some agents and sounds, in the form of `paper_table`.

    Its single apartments are none of ours, so their results stand beside no other.

    Parameters
    ----------
    sounds : mapping of str to collection of str
        Sounds by agent; `all` is the mean over the paper's three sounds.
    """
    table = paper_table()
    table = table[table["scene"] == AVERAGE]
    means = table.groupby(["agent", "scene"], as_index=False)[["sr", "spl"]].mean()
    table = pd.concat([table, means.assign(sound=ALL_SOUNDS)], ignore_index=True)
    pairs = zip(table["agent"], table["sound"], strict=True)
    return table[[sound in sounds.get(agent, ()) for agent, sound in pairs]]


def paper_averages(sounds: Mapping[str, Collection[str]]) -> dict[str, tuple[float, float]]:
    """Return the paper's success rate and SPL in % over all sounds and scenes by agent.

    Parameters
    ----------
    sounds : mapping of str to collection of str
        As for `paper_results`; agents without `all` are left out.
    """
    table = paper_results(sounds)
    average = table[table["sound"] == ALL_SOUNDS]
    return {
        str(row["agent"]): (float(row["sr"]), float(row["spl"]))
        for row in average.to_dict("records")
    }
