"""The card of a trained network: what it is, what it was trained on, how good it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from avn.core.files import atomic_write

CARD = "model_card.md"
# Headings after Mitchell et al., "Model cards for model reporting" (FAT* 2019), where they apply.
_LIMITS = (
    "Trained on apartments and recordings made by this project alone: of real rooms, microphones "
    "and cameras nothing is known. Figures of validation apartments are those by which checkpoints "
    "and settings were chosen."
)


def write_card(
    folder: Path,
    title: str,
    data: Mapping[str, str],
    recipe: Mapping[str, Any],
    figures: Mapping[str, Any],
) -> None:
    """Write `model_card.md` into a network's folder.

    Parameters
    ----------
    folder : Path
    title : str
        What it is and does.
    data : mapping of str to str
        What it was trained and measured on, by a word for each.
    recipe : mapping
        The config that it was built from.
    figures : mapping
        What was measured; numbers alone are shown.
    """
    lines = [f"# {title}", "", "## Data", "", *(f"- {what}: {text}" for what, text in data.items())]
    lines += ["", "## Figures", "", "| figure | value |", "| --- | --- |"]
    numbers = {name: value for name, value in figures.items() if isinstance(value, int | float)}
    lines += [f"| `{name}` | {numbers[name]:.4g} |" for name in sorted(numbers)]
    text = yaml.safe_dump(dict(recipe), sort_keys=True, allow_unicode=True)
    lines += ["", "## Recipe", "", "```yaml", text.rstrip(), "```"]
    lines += ["", "## Limits", "", _LIMITS, "", "## Licence", "", "Apache-2.0, as the code.", ""]
    with atomic_write(folder / CARD) as part:
        part.write_text("\n".join(lines), encoding="utf-8")
