"""Synthesised sounds: cells of the parameters of each family, with frozen splits.

`sound_families.csv` lists them. Cells of different splits of a family differ in every parameter
that changes its timbre.
"""

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sound_noises
import sound_synthesis


@dataclass(frozen=True)
class Family:
    """Synthesised sound: its name, split, words for a table, function and parameters."""

    name: str
    split: str
    title: str
    function: Callable[..., Any]
    parameters: tuple[Any, ...]


def read_families() -> list[Family]:
    """Read the list of the synthesised sounds."""
    path = Path(__file__).with_name("sound_families.csv")
    with path.open(encoding="utf-8", newline="") as file:
        return [family_of(row) for row in csv.DictReader(file)]


def family_of(row: dict[str, str]) -> Family:
    """Return the sound of a row of the list."""
    functions = vars(sound_noises) | vars(sound_synthesis)
    parameters = as_tuples(json.loads(row["parameters"]))
    return Family(row["name"], row["split"], row["title"], functions[row["function"]], parameters)


def as_tuples(value: Any) -> Any:
    """Turn lists into tuples, also inside others."""
    return tuple(map(as_tuples, value)) if isinstance(value, list) else value


SYNTHESISED = read_families()
