"""Model cards of trained networks: data, metrics, configuration and limits."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from avn.core.files import atomic_write

CARD = "model_card.md"
# The headings follow Mitchell et al., "Model cards for model reporting", FAT* 2019.
_LIMITS = (
    "Trained only on apartments and sounds of this project; the performance with real rooms, "
    "microphones and cameras is unknown. Checkpoints and settings were selected by the metrics of "
    "the validation apartments."
)


def write_card(
    folder: Path,
    title: str,
    data: Mapping[str, str],
    recipe: Mapping[str, Any],
    metrics: Mapping[str, Any],
) -> None:
    """Write `model_card.md` into a network's folder.

    Parameters
    ----------
    folder : Path
    title : str
        Description of the network.
    data : mapping of str to str
        Training and evaluation data: text by keyword.
    recipe : mapping
        Config of the network.
    metrics : mapping
        Metrics by name; entries that are not numbers are left out.
    """
    lines = [f"# {title}", "", "## Data", "", *(f"- {what}: {text}" for what, text in data.items())]
    lines += ["", "## Metrics", "", "| metric | value |", "| --- | --- |"]
    numbers = {name: value for name, value in metrics.items() if isinstance(value, int | float)}
    lines += [f"| `{name}` | {numbers[name]:.4g} |" for name in sorted(numbers)]
    text = yaml.safe_dump(dict(recipe), sort_keys=True, allow_unicode=True)
    lines += ["", "## Configuration", "", "```yaml", text.rstrip(), "```"]
    lines += ["", "## Limits", "", _LIMITS, "", "## Licence", "", "Apache-2.0, as the code.", ""]
    with atomic_write(folder / CARD) as part:
        part.write_text("\n".join(lines), encoding="utf-8")
