"""Splits of apartments into training, validation and test."""

from __future__ import annotations

import dataclasses
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.floor_plan_file import load
from avn.apartments.frozen_hashes import check_hash, check_settings, frozen_apartments
from avn.apartments.generator import SIZES, generate
from avn.apartments.settings import SplitConfig
from avn.apartments.symmetry import Key, layout_key
from avn.core.errors import UserError
from avn.core.random import derive

PARTS = ("train", "validation", "test")
FROZEN = Path(__file__).parents[1] / "assets" / "floor_plans"
# Fields of a split that select no apartments: defaults of a training.
DEFAULTS = ("more_training", "total_steps", "validate_every")
# Generated apartments that networks train on besides those of a folder, all but their number.
MORE_TRAINING = SplitConfig(name="procedural", seed=1000, size="mixed", train_sources=10)


def load_split(cfg: SplitConfig) -> Mapping[str, list[FloorPlan]]:
    """Read or generate the apartments of a split.

    Parameters
    ----------
    cfg : SplitConfig
        Settings.

    Returns
    -------
    mapping of list of FloorPlan
        Under `train`, `validation` and `test`; a folder may have apartments of some parts only.
        Generated apartments are drawn when their part is asked for.
        Each layout is reserved for one part, in all generated splits. Within a part, layouts of
        generated apartments are unique, also up to rotation and mirroring; those of `homes` are
        not made to be, so that an apartment depends on its number alone.

    Raises
    ------
    UserError
        If there is no apartment, a file or folder is missing or not valid, or a number is out of
        range.
    """
    return _generated(cfg) if cfg.folder is None else _frozen(cfg.folder)


def more_training(cfg: SplitConfig, count: int) -> list[FloorPlan]:
    """Generate apartments for training besides those of a folder.

    They are the first training apartments of the split `procedural`, so none has the layout of a
    validation or test apartment of any generated split.

    Parameters
    ----------
    cfg : SplitConfig
        Split of the training world.
    count : int
        Their number.

    Raises
    ------
    UserError
        If the number is negative, or the split is generated itself.
    """
    if count < 0:
        raise UserError(f"training.generated: {count}; give 0 or more")
    if not count:
        return []
    if cfg.folder is None:
        raise UserError(
            f"training.generated: the split '{cfg.name}' is generated itself; give 0, and more "
            "apartments with training.scenes.train"
        )
    return _generated(dataclasses.replace(MORE_TRAINING, train=count))["train"]


def _frozen(name: str) -> dict[str, list[FloorPlan]]:
    if not name:
        raise UserError("split.folder is empty; give a folder of floor plans (*.json)")
    # only a plain name is one of the package, so that "." and "../mine" are folders of the user
    is_own = name not in {path.name for path in FROZEN.iterdir()}
    folder = Path(name).expanduser() if is_own else FROZEN / name
    if not folder.is_dir():
        what = "is a file" if folder.is_file() else "does not exist"
        raise UserError(f"split.folder: {name} {what}; give a folder of floor plans (*.json)")
    split: dict[str, list[FloorPlan]] = {part: [] for part in PARTS}
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.suffix.lower() in (".yaml", ".yml") or path.suffix == ".JSON":
            raise UserError(f"{path}: not read; floor plans are files *.json, write it as one")
        if path.suffix == ".json":
            split[_part_of_file(path)].append(_named_like(path))
    if not any(split.values()):
        raise UserError(f"split.folder: no floor plan in {name}; add one, such as room_1.json")
    return split


def _named_like(path: Path) -> FloorPlan:
    plan = load(path)
    if plan.name != path.stem:
        raise UserError(f"{path}: the plan is named {plan.name!r}; name it like its file")
    return plan


def _part_of_file(path: Path) -> str:
    """Return the part of a file by its name; refuse a name that is almost one of another part."""
    parts = {"train": "train", "val": "validation"}
    word = path.stem.split("_")[0]
    similar = re.match("[a-z]*", path.stem.lower())[0]  # type: ignore[index]  # matches ""
    if word not in parts and similar in ("train", "training", "val", "valid", "validation"):
        raise UserError(
            f"{path}: not clear whether it is a test apartment; name it train_*.json, val_*.json "
            "or without that word"
        )
    return parts.get(word, "test")


class _Generated(Mapping[str, list[FloorPlan]]):
    """Generated apartments; those of a part are drawn when the part is asked for."""

    def __init__(self, cfg: SplitConfig) -> None:
        self._cfg = cfg
        self._drawn: dict[str, list[FloorPlan]] = {}

    def __getitem__(self, part: str) -> list[FloorPlan]:
        """Return the apartments of a part."""
        if part not in self._drawn and part in PARTS:
            self._drawn[part] = _generated_part(self._cfg, part)
        return self._drawn[part]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the parts."""
        return iter(PARTS)

    def __len__(self) -> int:
        """Return the number of parts."""
        return len(PARTS)


def _generated(cfg: SplitConfig) -> _Generated:
    if cfg.size not in SIZES:
        raise UserError(f"split.size is '{cfg.size}'; choose one of {', '.join(SIZES)}")
    for key in ("train", "validation", "test", "train_sources", "sources"):
        if getattr(cfg, key) < 1:
            raise UserError(f"split.{key} is {getattr(cfg, key)}; give at least 1")
    if cfg.seed < 0:
        raise UserError(f"split.seed is {cfg.seed}; give 0 or more")
    check_settings(cfg)
    return _Generated(cfg)


def _generated_part(cfg: SplitConfig, part: str) -> list[FloorPlan]:
    """Generate the apartments of a part.

    Each depends on its number alone, and where a layout comes again, on those before it. A size
    with soft furnishing has layouts that come again as they are, so that none is selected.
    """
    seen: set[Key] = set()
    plans = []
    frozen = frozen_apartments(cfg, part)
    for index in range(getattr(cfg, part)):
        skip = frozen[index].skip if frozen else 0
        plans.append(draw_apartment(cfg, part, index, seen, skip))
        if frozen:
            check_hash(plans[-1], frozen[index], str(cfg.hashes))
        if not SIZES[cfg.size].soft:
            seen.add(layout_key(plans[-1]))
    return plans


def draw_apartment(
    cfg: SplitConfig,
    part: str,
    index: int,
    seen: Collection[Key] = (),
    skip: int = 0,
    tally: Counter[str] | None = None,
) -> FloorPlan:
    """Generate one apartment of a split.

    Parameters
    ----------
    cfg : SplitConfig
        Settings.
    part : {"train", "validation", "test"}
        Its part.
    index : int
        Its number in the part, from 0.
    seen : collection of Key
        Layouts that it must not have, of `layout_key`.
    skip, tally
        As in `generate`.
    """

    def is_new(layout: FloorPlan) -> bool:
        key = layout_key(layout)
        return key not in seen and part_of_layout(key) == part

    name = {"train": "train", "validation": "val", "test": "room"}[part]
    sources = cfg.train_sources if part == "train" else cfg.sources
    seed = derive("apartment", cfg.seed, part, index)
    return generate(seed, f"{name}_{index + 1}", sources, cfg.size, is_new, skip, tally)


def part_of_layout(key: Key) -> str:
    """Return the one part that may have a generated layout, whatever the seed of the split.

    So a network never trains on a layout that another config tests.
    """
    return PARTS[derive("layout", *key) % len(PARTS)]
