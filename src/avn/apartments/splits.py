"""Splits of apartments into training, validation and test."""

from __future__ import annotations

from pathlib import Path

from avn.apartments.floor_plan import FloorPlan, load
from avn.apartments.generator import SIZES, generate
from avn.apartments.settings import SplitConfig
from avn.apartments.symmetry import layout_key
from avn.core.errors import UserError

PARTS = ("train", "validation", "test")
FROZEN = Path(__file__).parents[1] / "assets" / "floor_plans"
# Seeds that are tried for one apartment of a new layout.
_ATTEMPTS = 200


def load_split(cfg: SplitConfig) -> dict[str, list[FloorPlan]]:
    """Read or generate the apartments of a split.

    Parameters
    ----------
    cfg : SplitConfig
        Settings.

    Returns
    -------
    dict of list of FloorPlan
        Under `train`, `validation` and `test`; a folder may have apartments of some parts only.
        Layouts of generated apartments are unique, also up to rotation and mirroring.

    Raises
    ------
    UserError
        If there is no apartment, a file or folder is missing or not valid, or a number is out of
        range.
    """
    return _generated(cfg) if cfg.folder is None else _frozen(cfg.folder)


def _frozen(name: str) -> dict[str, list[FloorPlan]]:
    folder = FROZEN / name
    folder = folder if folder.is_dir() else Path(name).expanduser()
    if not folder.is_dir():
        raise UserError(f"split.folder: there is no folder {name}; give one with floor plans")
    split: dict[str, list[FloorPlan]] = {part: [] for part in PARTS}
    for path in sorted(folder.glob("*.json")):
        plan = load(path)
        if plan.name != path.stem:
            raise UserError(f"{path}: the plan is named '{plan.name}'; name it like its file")
        part = {"train": "train", "val": "validation"}.get(path.stem.split("_")[0], "test")
        split[part].append(plan)
    if not any(split.values()):
        raise UserError(f"split.folder: no floor plan in {name}; add one, such as room_1.json")
    return split


def _generated(cfg: SplitConfig) -> dict[str, list[FloorPlan]]:
    if cfg.size not in SIZES:
        raise UserError(f"split.size is '{cfg.size}'; choose one of {', '.join(SIZES)}")
    for key in ("train", "validation", "test", "train_sources", "sources"):
        if getattr(cfg, key) < 1:
            raise UserError(f"split.{key} is {getattr(cfg, key)}; give at least 1")
    if cfg.seed < 0:
        raise UserError(f"split.seed is {cfg.seed}; give 0 or more")
    seen = set()
    seed = cfg.seed
    split: dict[str, list[FloorPlan]] = {part: [] for part in PARTS}
    names = {"train": "train", "validation": "val", "test": "room"}
    for part in PARTS:
        sources = cfg.train_sources if part == "train" else cfg.sources
        for number in range(1, getattr(cfg, part) + 1):
            for _ in range(_ATTEMPTS):
                plan = generate(seed, f"{names[part]}_{number}", sources, cfg.size)
                seed += 1
                if layout_key(plan) not in seen:
                    break
            else:
                raise UserError(f"split.{part}: no new layout of size {cfg.size}; ask for fewer")
            seen.add(layout_key(plan))
            split[part].append(plan)
    return split
