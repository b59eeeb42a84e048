"""Table of all results in the layout of the paper, for a terminal, Markdown and LaTeX."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from rich.table import Table
from rich.text import Text

from avn.reporting.paper import PAPER, paper_results
from avn.reporting.results import (
    ALL_SOUNDS,
    INTERVAL,
    LABELS,
    NETWORK_INTERVAL,
    NO_INTERVAL,
    USUAL_LOOK,
    across_runs,
    shown_scenes,
)
from avn.reporting.table import readable

# Lines of a cell.
OWN, ENDS_LINE, SPREAD, NETWORKS = "own", "95 %", "± over seeds", "± over networks"
ENDS = ("low", "high")
_VALUES = ("", "_low", "_high", "_std", "_network_std")


def published(
    episodes: pd.DataFrame,
    paper: Mapping[str, Collection[str]] = MappingProxyType({}),
) -> pd.DataFrame:
    """Combine the results of all runs into one row per agent, setting, sound and scene.

    Parameters
    ----------
    episodes : DataFrame
        Episodes of all runs, those of several networks with a column `train_seed`.
    paper : mapping of str to collection of str
        Sounds by agent beside which the paper's results stand; see
        `avn.reporting.paper.paper_results`.

    Returns
    -------
    DataFrame
        `LABELS`, `sound`, `scene`, `networks`; `sr` and `spl`, means over runs in %; `sr_low` to
        `spl_high`, the 95 % intervals of `avn.reporting.results.across_runs`; `sr_std` and
        `spl_std`, standard deviations over seeds, and `sr_network_std` and `spl_network_std`, over
        networks; `paper_sr` and `paper_spl`, NaN where the paper's results do not belong.
    """
    percent = [f"{metric}{end}" for metric in ("sr", "spl") for end in _VALUES]
    found = across_runs(episodes)[[*LABELS, "sound", "scene", "networks", *percent]]
    found[percent] *= 100.0
    own = paper_results(paper).rename(columns={"sr": "paper_sr", "spl": "paper_spl"})
    return found.merge(own, on=["agent", "sound", "scene"], how="left", sort=False)


def terminal(cells: pd.DataFrame, privileged: Collection[str] = ()) -> Table:
    """Lay the table out for a terminal; agents in `privileged` are marked as upper bounds."""
    scenes = shown_scenes(cells)
    title = f"success rate / SPL, % ({_settings(cells)})"
    table = Table(title=title, box=None, pad_edge=False, title_justify="left")
    table.add_column("", no_wrap=True)
    for scene in scenes:
        table.add_column(readable(scene), justify="right", no_wrap=True)
    for agent, own in cells.groupby("agent", sort=False):
        table.add_row(Text(f"{agent}{_mark(str(agent), privileged)}", style="bold"))
        for sound, part in own.groupby("sound", sort=False):
            lines = pd.DataFrame(map(_lines, _in_scenes(part, scenes)))
            table.add_row(Text(f"  {sound}"), *lines[OWN])
            for name in (ENDS_LINE, SPREAD, NETWORKS, PAPER):
                if lines[name].any():
                    table.add_row(f"    {name}", *lines[name], style="dim")
    return table


def legend(cells: pd.DataFrame) -> str:
    """Name the lines below each pair of success rate and SPL, and what is missing and why."""
    lines = []
    if cells["sr_low"].notna().any():
        over = NETWORK_INTERVAL if (cells["networks"] > 1).any() else INTERVAL
        lines.append(f"the interval ({over})")
    if cells["sr_std"].notna().any():
        lines.append("the standard deviation over seeds")
    if cells["sr_network_std"].notna().any():
        lines.append(f"the standard deviation over {cells['networks'].max()} networks")
    if cells["paper_sr"].notna().any():
        lines.append(f"in parentheses, the results of the paper ({PAPER})")
    text = f"Below each pair: {'; '.join(lines)}." if lines else ""
    if cells["sr_low"].isna().any():
        text += f" A pair without interval has {NO_INTERVAL}."
    return text.strip()


def markdown(
    cells: pd.DataFrame,
    sounds: Sequence[str],
    privileged: Collection[str] = (),
    caption: str = "",
) -> str:
    """Format the table as Markdown, one table per sound with rows of agents.

    Parameters
    ----------
    cells : DataFrame
        As `published` returns it.
    sounds : sequence of str
        Names of the sounds, in order.
    privileged : collection of str
        Agents that are marked as upper bounds.
    caption : str
        World of the results.
    """
    text = [f"Success rate / SPL in % ({_settings(cells)}). {legend(cells)}".strip(), ""]
    for line in caption.splitlines():
        text += [f"{line[:1].upper()}{line[1:]}.", ""]
    for sound, part in _by_sound(cells, sounds):
        scenes = shown_scenes(part)
        text += [f"### {sound}", "", f"| | {' | '.join(_cell_safe(readable(r)) for r in scenes)} |"]
        text.append("| --- " * (1 + len(scenes)) + "|")
        for agent, own in part.groupby("agent", sort=False):
            found = [_stacked(_lines(row), "<br>") for row in _in_scenes(own, scenes)]
            name = _cell_safe(f"`{agent}`{_mark(str(agent), privileged)}")
            text.append(f"| {name} | {' | '.join(found)} |")
        text.append("")
    return "\n".join(text)


def latex(
    cells: pd.DataFrame,
    sounds: Sequence[str],
    privileged: Collection[str] = (),
    caption: str = "",
) -> str:
    """Format the table as one LaTeX `tabular`, with a `shortstack` per cell.

    Parameters
    ----------
    cells : DataFrame
        As `published` returns it.
    sounds : sequence of str
        Names of the sounds, in order.
    privileged : collection of str
        Agents that are marked as upper bounds.
    caption : str
        World of the results, printed in the last row of the table.
    """
    scenes = shown_scenes(cells)
    text = [f"% success rate / SPL in %: {_settings(cells)}. {legend(cells)}".strip()]
    text += ["\\begin{tabular}{ll" + "c" * len(scenes) + "}", "\\hline"]
    heads = ["Sound", "Agent", *(_escaped(readable(scene)) for scene in scenes)]
    text.append(" & ".join(heads) + " \\\\ \\hline")
    for sound, part in _by_sound(cells, sounds):
        for agent, own in part.groupby("agent", sort=False):
            # braces, or LaTeX reads the bracket of an interval as a length
            stacks = [_stacked(_lines(row), " \\\\{} ") for row in _in_scenes(own, scenes)]
            found = ["\\shortstack{" + stack.replace("±", "$\\pm$") + "}" for stack in stacks]
            name = _escaped(f"{agent}{_mark(str(agent), privileged)}")
            text.append(" & ".join([_escaped(sound), name, *found]) + " \\\\")
        text.append("\\hline")
    for line in caption.splitlines():
        text.append(
            f"\\multicolumn{{{2 + len(scenes)}}}{{l}}{{\\footnotesize {_escaped(line)}}} \\\\"
        )
    return "\n".join([*text, "\\end{tabular}", ""])


def _settings(cells: pd.DataFrame) -> str:
    """Describe the protocol, acoustics and `look` settings of a table."""
    values = {key: list(dict.fromkeys(map(str, cells[key]))) for key in LABELS[1:]}
    if values["look"] == [USUAL_LOOK]:
        del values["look"]
    return ", ".join(f"{key}={' and '.join(own)}" for key, own in values.items())


def _mark(agent: str, privileged: Collection[str]) -> str:
    """Return the suffix of a privileged agent's name."""
    return " (upper bound)" if agent in privileged else ""


def _cell_safe(text: str) -> str:
    return text.replace("|", "\\|")


def _by_sound(cells: pd.DataFrame, sounds: Sequence[str]) -> list[tuple[str, pd.DataFrame]]:
    """Split a table by sound; all sounds pooled come last."""
    named = [*sounds, *([ALL_SOUNDS] if len(sounds) > 1 else [])]
    return [(sound, cells[cells["sound"] == sound]) for sound in named]


def _in_scenes(part: pd.DataFrame, scenes: list[str]) -> list[dict[Hashable, Any]]:
    """Return the cells of one agent and sound in the order of the scenes."""
    return part.set_index("scene").reindex(scenes).to_dict("records")


def _lines(row: dict[Hashable, Any]) -> dict[str, str]:
    """Format the lines of one cell; those without data are empty."""
    low, high = ([f"{row[f'{name}_{end}']:.0f}" for name in ("sr", "spl")] for end in ENDS)
    ends = [one if one == other else f"{one}-{other}" for one, other in zip(low, high, strict=True)]
    return {
        OWN: _pair(row["sr"], row["spl"]),
        ENDS_LINE: "" if np.isnan(row["sr_low"]) else " / ".join(ends),
        SPREAD: _pair(row["sr_std"], row["spl_std"]),
        NETWORKS: _pair(row["sr_network_std"], row["spl_network_std"]),
        PAPER: _pair(row["paper_sr"], row["paper_spl"]),
    }


def _stacked(lines: dict[str, str], between: str) -> str:
    marked = {ENDS_LINE: "[{}]", SPREAD: "± {}", NETWORKS: "± {} over networks", PAPER: "({})"}
    found = [marked.get(name, "{}").format(line) for name, line in lines.items() if line]
    return between.join(found)


def _pair(sr: float, spl: float) -> str:
    return "" if np.isnan(sr) else f"{sr:.1f} / {spl:.1f}"


def _escaped(text: str) -> str:
    special = {c: f"\\{c}" for c in "&%$#_{}"} | {c: f"\\{c}{{}}" for c in "~^"}
    special["\\"] = "\\textbackslash{}"
    return "".join(special.get(c, c) for c in text)
