"""Tables of hashes of generated apartments, which freeze a split without storing floor plans.

Besides the hash of its floor plan, an apartment has the number of draws that gave no valid
apartment. They are skipped, so that the whole split is generated in seconds.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.settings import SplitConfig
from avn.core.errors import UserError
from avn.core.hashing import digest

FOLDER = Path(__file__).parents[1] / "assets" / "floor_plan_hashes"
# Settings that a floor plan depends on, besides its part and number.
SETTINGS = ("seed", "size", "train_sources", "sources")
PARTS = ("train", "validation", "test")


def floor_plan_hash(plan: FloorPlan) -> str:
    """Return the SHA-256 of a floor plan, in hex."""
    return digest(plan.to_dict())


@dataclass(frozen=True)
class FrozenApartment:
    """Entry of a table: draws of the generator to skip, and the hash of the floor plan."""

    skip: int
    hash: str


def frozen_apartments(cfg: SplitConfig, part: str) -> list[FrozenApartment]:
    """Read the frozen apartments of a part; none if the split has no table."""
    if cfg.hashes is None:
        return []
    return [FrozenApartment(**entry) for entry in _table(cfg.hashes)[part]]


def write_table(name: str, cfg: SplitConfig, parts: Mapping[str, list[FrozenApartment]]) -> None:
    """Write the table of a split's frozen apartments.

    Parameters
    ----------
    name : str
        Name of the table.
    cfg : SplitConfig
        Settings of the split.
    parts : mapping of list of FrozenApartment
        Apartments of each part.
    """
    lines = [f' "settings": {json.dumps({key: getattr(cfg, key) for key in SETTINGS})}']
    for part, entries in parts.items():
        rows = ",\n  ".join(json.dumps(asdict(entry)) for entry in entries)
        lines.append(f' "{part}": [\n  {rows}\n ]')
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    (FOLDER / f"{name}.json").write_text(text, encoding="utf-8")


@cache
def _table(name: str) -> dict[str, Any]:
    tables = sorted(file.stem for file in FOLDER.glob("*.json"))
    if name not in tables:
        raise UserError(
            f"split.hashes is '{name}'; choose {' or '.join(tables)}, or null for apartments "
            "that are not frozen"
        )
    table: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return table


def check_settings(cfg: SplitConfig) -> None:
    """Refuse settings other than those that the split is frozen with.

    Raises
    ------
    UserError
        If there is no such table, a setting has another value, or there are not as many frozen
        apartments.
    """
    if cfg.hashes is None:
        return
    table = _table(cfg.hashes)
    for key in SETTINGS:
        value, frozen = getattr(cfg, key), table["settings"][key]
        if value != frozen:
            raise UserError(
                f"split.{key} is {value}, and the apartments of '{cfg.hashes}' are frozen with "
                f"{frozen}; leave it out, or add split.hashes=null for other apartments"
            )
    for part in PARTS:
        if getattr(cfg, part) > len(table[part]):
            raise UserError(
                f"split.{part} is {getattr(cfg, part)}, and '{cfg.hashes}' has {len(table[part])} "
                "frozen apartments of this part; give at most as many, or add split.hashes=null"
            )


def check_hash(plan: FloorPlan, frozen: FrozenApartment, table: str) -> None:
    """Compare a generated apartment with the frozen one.

    Parameters
    ----------
    plan : FloorPlan
        The apartment.
    frozen : FrozenApartment
        Its entry.
    table : str
        Name of the table, for the message.

    Raises
    ------
    UserError
        If the hash of the floor plan is another.
    """
    found = floor_plan_hash(plan)
    if found != frozen.hash:
        raise UserError(
            f"split.hashes: apartment {plan.name} of '{table}' is frozen as floor plan "
            f"{frozen.hash[:8]} and was generated as {found[:8]}; install the versions of avn and "
            "NumPy that it was frozen with, or add split.hashes=null to use it as generated"
        )
