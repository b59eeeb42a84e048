"""Table of the recordings of the package: names, categories and frozen splits."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable

SPLITS = ("train", "validation", "test")


@dataclass(frozen=True)
class PackagedSound:
    """Recording of the package, a row of `assets/dry_sounds/sounds.csv`.

    Attributes
    ----------
    name : str
        Name, such as `dog_pair`; it is accepted wherever the path of an audio file is.
    category : str
        Category, such as `dog`.
    split : {"train", "validation", "test"}
        Split of the recording.
    category_split : {"train", "validation", "test"}
        Split of its category.
    """

    name: str
    category: str
    split: str
    category_split: str


@cache
def packaged_sounds() -> dict[str, PackagedSound]:
    """Read the recordings of the package by name, in the order of the table."""
    lines = (sounds_folder() / "sounds.csv").read_text(encoding="utf-8").splitlines()
    fields = PackagedSound.__dataclass_fields__
    rows = [{key: row[key] for key in fields} for row in csv.DictReader(lines)]
    return {row["name"]: PackagedSound(**row) for row in rows}


def packaged_file(name: str) -> Traversable:
    """Return the file of a recording of the package.

    Parameters
    ----------
    name : str
        A key of `packaged_sounds`.
    """
    sound = packaged_sounds()[name]
    has_folder = name.startswith(f"{sound.category}_")  # the benchmark's three have none
    folder = sounds_folder() / sound.category if has_folder else sounds_folder()
    return folder / f"{name}.flac"


def sounds_folder() -> Traversable:
    """Return the folder of the recordings of the package."""
    return resources.files("avn") / "assets" / "dry_sounds"


def select(
    category: Iterable[str] | None = None,
    split: Iterable[str] = SPLITS,
    category_split: Iterable[str] = SPLITS,
) -> list[str]:
    """Select recordings of the package.

    Parameters
    ----------
    category : iterable of str, optional
        Categories; all by default.
    split, category_split : iterable of str
        Splits of the recordings and of their categories.

    Returns
    -------
    list of str
        Names, in the order of the table.
    """
    wanted = None if category is None else set(category)
    splits, category_splits = set(split), set(category_split)
    return [
        sound.name
        for sound in packaged_sounds().values()
        if (wanted is None or sound.category in wanted)
        and sound.split in splits
        and sound.category_split in category_splits
    ]
