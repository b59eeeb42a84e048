"""The results as the paper lays them out, as Markdown and LaTeX, beside the paper's own figures."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from avn.reporting.results import ALL_SOUNDS, AVERAGE, LABELS, across_seeds, summarise
from avn.reporting.table import PAPER_PROTOCOL, paper_table

# One seed for all, so that the episodes of several seeds are one run with one interval.
_POOLED = -1


def published(runs: pd.DataFrame, episodes: pd.DataFrame) -> pd.DataFrame:
    """One line for each agent, setting, sound and room.

    Parameters
    ----------
    runs : DataFrame
        Results of all runs, as `avn.reporting.results.summarise` gives them.
    episodes : DataFrame
        Their episodes.

    Returns
    -------
    DataFrame
        `LABELS`, sound, room; sr and spl in %, means over the runs; `sr_low` to `spl_high`, 95 %
        intervals over (room, source) clusters of all their episodes together; `sr_std` and
        `spl_std`, the spread over seeds; `paper_sr` and `paper_spl`, NaN where the paper has none.
    """
    keys = [*LABELS, "sound", "room"]
    intervals = summarise(episodes.assign(seed=_POOLED))
    ends = [f"{figure}_{end}" for figure in ("sr", "spl") for end in ("low", "high")]
    spread = across_seeds(runs)[[*keys, "sr", "spl", "sr_std", "spl_std"]]
    found = spread.merge(intervals[[*keys, *ends]], on=keys, how="left", sort=False)
    percent = ["sr", "spl", "sr_std", "spl_std", *ends]
    found[percent] *= 100.0
    paper = paper_table()
    means = paper.groupby(["agent", "room"], as_index=False)[["sr", "spl"]].mean()
    paper = pd.concat([paper, means.assign(sound=ALL_SOUNDS)]).assign(protocol=PAPER_PROTOCOL)
    paper = paper.rename(columns={"sr": "paper_sr", "spl": "paper_spl"})
    return found.merge(paper, on=["agent", "protocol", "sound", "room"], how="left", sort=False)


def markdown(table: pd.DataFrame, sounds: Sequence[str]) -> str:
    """A table for each sound: agents down, rooms across, the paper's figures under ours."""
    lines = [
        "Success rate / SPL in %; in brackets the paper's; of the average the 95 % interval.",
        "",
    ]
    for sound, part in _by_sound(table, sounds):
        rooms = list(dict.fromkeys(part["room"]))
        lines += [
            f"### {sound}",
            "",
            f"| | {' | '.join(rooms)} |",
            "| --- " * (1 + len(rooms)) + "|",
        ]
        for agent, own in part.groupby("agent", sort=False):
            found = own.set_index("room").reindex(rooms)
            found["average"] = found.index == AVERAGE
            cells = [_cell(row) for row in found.to_dict("records")]
            lines.append(f"| `{agent}` | {' | '.join(cells)} |")
        lines.append("")
    return "\n".join(lines)


def latex(table: pd.DataFrame, sounds: Sequence[str]) -> str:
    """The same as one `tabular`, success over SPL in each cell as the paper has it."""
    rooms = list(dict.fromkeys(table["room"]))
    lines = ["\\begin{tabular}{ll" + "c" * len(rooms) + "}", "\\hline"]
    lines.append(" & ".join(["Sound", "Agent", *map(_escaped, rooms)]) + " \\\\ \\hline")
    for sound, part in _by_sound(table, sounds):
        for agent, own in part.groupby("agent", sort=False):
            found = own.set_index("room").reindex(rooms)
            cells = [_pair(row["sr"], row["spl"]) for row in found.to_dict("records")]
            lines.append(" & ".join([_escaped(sound), _escaped(str(agent)), *cells]) + " \\\\")
        lines.append("\\hline")
    return "\n".join([*lines, "\\end{tabular}", ""])


def _by_sound(table: pd.DataFrame, sounds: Sequence[str]) -> list[tuple[str, pd.DataFrame]]:
    """The parts of a table, those of all sounds together last."""
    named = [*sounds, *([ALL_SOUNDS] if len(sounds) > 1 else [])]
    return [(sound, table[table["sound"] == sound]) for sound in named]


def _cell(row: dict[Hashable, Any]) -> str:
    own, paper = _pair(row["sr"], row["spl"]), _pair(row["paper_sr"], row["paper_spl"])
    low = _pair(row["sr_low"], row["spl_low"])
    high = _pair(row["sr_high"], row["spl_high"])
    interval = f" [{low} to {high}]" if row["average"] and low else ""
    return own + interval + (f" ({paper})" if paper else "")


def _pair(sr: float, spl: float) -> str:
    return "" if np.isnan(sr) else f"{sr:.1f} / {spl:.1f}"


def _escaped(text: str) -> str:
    special = {c: f"\\{c}" for c in "&%$#_{}"} | {"\\": "\\textbackslash{}", "~": "\\~{}"}
    return "".join(special.get(c, c) for c in text)
