"""Table of rows x conditions: success rate and SPL over all scenes and sounds, with intervals."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from rich.table import Table
from rich.text import Text

from avn.reporting.results import ALL_SOUNDS, AVERAGE, DYNAMIC_HEADINGS, across_runs, metrics_of

CONDITION = "condition"
_ENDS = ("", "_low", "_high", "_network_std")
_PERCENT = tuple(f"{metric}{end}" for metric in ("sr", "spl") for end in _ENDS)


def condition_cells(episodes: pd.DataFrame) -> pd.DataFrame:
    """Compute a row for each agent and condition.

    Parameters
    ----------
    episodes : DataFrame
        Episodes of all runs, with the columns `condition` and, of several networks, `train_seed`.

    Returns
    -------
    DataFrame
        `agent`, `condition`, `protocol`, `acoustics`, `look`, `networks`, `episodes` of each
        network, and in %: `sr`, `spl`, their 95 % intervals over networks, apartments, sources and
        episodes, and their standard deviations over networks. The same of `sws`, `dsr`,
        `dspl`, `ndtg` (%) and `drift` (metres) where a condition has them; see
        `avn.reporting.results.DYNAMIC_METRICS`.
    """
    rows = []
    for condition, own in episodes.groupby(CONDITION, sort=False):
        # columns of other conditions are empty; the sounds are pooled: an episode has one of many
        own = own.drop(columns=CONDITION).dropna(axis="columns", how="all")
        found = across_runs(own.assign(sound=ALL_SOUNDS))
        average = found[found["scene"] == AVERAGE]
        rows.append(average.assign(**{CONDITION: condition}))
    cells = pd.concat(rows, ignore_index=True)
    cells["episodes"] //= cells["networks"]
    cells[list(_PERCENT)] *= 100.0
    dynamic = [
        f"{metric}{end}"
        for metric in metrics_of(episodes)
        if metric in DYNAMIC_HEADINGS
        for end in _ENDS
    ]
    for column in dynamic:
        cells[column] *= DYNAMIC_HEADINGS[column.split("_")[0]][1]
    labels = ["agent", CONDITION, "protocol", "acoustics", "look", "networks", "episodes"]
    return cells[[*labels, *_PERCENT, *dynamic]]


def terminal(cells: pd.DataFrame, conditions: Sequence[str], agents: Sequence[str]) -> Table:
    """Lay the table out for a terminal: a row for each condition, a column for each agent.

    Parameters
    ----------
    cells : DataFrame
        Result of `condition_cells`.
    conditions, agents : sequence of str
        Rows and columns in order.
    """
    table = Table(title="success rate / SPL, %", box=None, pad_edge=False, title_justify="left")
    table.add_column("", no_wrap=True)
    for agent in agents:
        table.add_column(agent, justify="right", no_wrap=True)
    for condition in conditions:
        texts = [_text(cells, agent, condition) for agent in agents]
        table.add_row(Text(condition, style="bold"), *(main for main, _ in texts))
        if any(interval for _, interval in texts):
            table.add_row("  95 %", *(interval for _, interval in texts), style="dim")
        for unit, values in _others(cells, agents, condition):
            table.add_row(f"  {unit}", *values, style="dim")
    return table


def markdown(cells: pd.DataFrame, conditions: Sequence[str], agents: Sequence[str]) -> str:
    """Format the table as Markdown. See `terminal`."""
    lines = [f"| condition | {' | '.join(f'`{agent}`' for agent in agents)} |"]
    lines.append("| --- " * (1 + len(agents)) + "|")
    for condition in conditions:
        texts = [_text(cells, agent, condition) for agent in agents]
        found = [f"{main}<br>{interval}" if interval else main for main, interval in texts]
        for unit, values in _others(cells, agents, condition):
            found = [
                f"{text}<br>{unit}: {value}" if value else text
                for text, value in zip(found, values, strict=True)
            ]
        lines.append(f"| `{condition}` | {' | '.join(found)} |")
    return "\n".join([*lines, ""])


def _others(
    cells: pd.DataFrame, agents: Sequence[str], condition: str
) -> list[tuple[str, list[str]]]:
    """Return the further metrics of a condition: name with unit, and the text of each agent."""
    own = cells[cells[CONDITION] == condition].set_index("agent")
    found = []
    for metric, (heading, _) in DYNAMIC_HEADINGS.items():
        if metric in own and own[metric].notna().any():
            values = own[metric].reindex(list(agents))
            texts = ["" if pd.isna(value) else f"{value:.1f}" for value in values]
            found.append((heading, texts))
    return found


def _text(cells: pd.DataFrame, agent: str, condition: str) -> tuple[str, str]:
    """Return success rate and SPL of a cell, "-" without one, and their intervals, if any."""
    own = cells[(cells["agent"] == agent) & (cells[CONDITION] == condition)]
    if not len(own):
        return "-", ""
    row = own.iloc[0]
    main = f"{row['sr']:.1f} / {row['spl']:.1f}"
    if pd.isna(row["sr_low"]):
        return main, ""
    ends = "{:.0f} to {:.0f} / {:.0f} to {:.0f}"
    keys = ("sr_low", "sr_high", "spl_low", "spl_high")
    return main, ends.format(*(row[key] for key in keys))
