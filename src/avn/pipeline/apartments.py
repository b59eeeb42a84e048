"""Apartments of the test world and the training world, and stages with a file per apartment.

Agents are evaluated in the test world and networks trained in the training world. By default both
have the same split and the same acoustics.
"""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.frozen_hashes import floor_plan_hash
from avn.apartments.grid import build_grid
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import DEFAULTS, PARTS, load_split, more_training
from avn.core.errors import UserError
from avn.core.files import check_name, partial_folder
from avn.core.hashing import canonical, digest
from avn.core.settings import typed
from avn.pipeline.stage import Stage


@dataclass(frozen=True)
class WorldKeys:
    """Config keys of a world's nodes.

    Attributes
    ----------
    split, acoustics, microphone, sounds : str
        Keys of the apartments, the acoustics, the microphone and the sounds.
    generated : str, optional
        Key of the number of generated training apartments besides those of the split.
    """

    split: str
    acoustics: str
    microphone: str
    sounds: str
    generated: str | None = None


TEST = WorldKeys("split", "acoustics", "microphone", "sound")
TRAINING = WorldKeys(
    "training.scenes",
    "training.acoustics",
    "training.microphone",
    "training.sounds",
    "training.generated",
)


@dataclass(frozen=True)
class Apartments:
    """Apartments of one subset of a world's split.

    Attributes
    ----------
    cfg : DictConfig
        Config of a command.
    subset : {"train", "validation", "test"}
        Subset of the split.
    world : WorldKeys
        Config keys of the world.
    """

    cfg: DictConfig = field(compare=False, repr=False)
    subset: str
    world: WorldKeys = TEST

    @property
    def plans(self) -> list[FloorPlan]:
        """Floor plans of the apartments.

        Raises
        ------
        UserError
            Where there are none, or the split cannot be read.
        """
        split = OmegaConf.select(self.cfg, self.world.split)
        check_name(f"{self.world.split}.name", split.name)
        plans = [*_plans(split)[self.subset]]
        if key := self._generated:
            plans += _more_training(split, OmegaConf.select(self.cfg, key))
        if not plans:
            where = f" in {split.folder}" if split.folder else ""
            elsewhere = ", or train in another split with training.scenes=var"
            elsewhere = elsewhere if self.world == TRAINING else ""
            raise UserError(
                f"{self.world.split}.{self.subset} is empty: no floor plan of that subset{where}; "
                f"add one (train_*.json, val_*.json, any other name for test){elsewhere}"
            )
        return plans

    @property
    def cells(self) -> int:
        """Total number of free cells."""
        return sum(cells_of(plan) for plan in self.plans)

    @property
    def pairs(self) -> int:
        """Total number of pairs of source and free cell."""
        return sum(len(plan.sources) * cells_of(plan) for plan in self.plans)

    def node(self, name: str) -> Any:
        """Return the world's config node of a name, such as `acoustics`."""
        return OmegaConf.select(self.cfg, getattr(self.world, name))

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the split that the apartments depend on; a folder needs no generator."""
        names: tuple[str, ...] = ("name", "folder")
        if self.node("split").folder is None:
            every = (each.name for each in dataclasses.fields(SplitConfig))
            names = tuple(name for name in every if name not in DEFAULTS)
        keys = tuple(f"{self.world.split}.{name}" for name in names)
        return (*keys, self._generated) if self._generated else keys

    @property
    def _generated(self) -> str | None:
        return self.world.generated if self.subset == "train" else None

    @property
    def title(self) -> str:
        """Description of the apartments, for titles of stages."""
        return f"the {self.subset} apartments of '{self.node('split').name}'"


def apartments_of_all_subsets(cfg: DictConfig, world: WorldKeys = TEST) -> list[Apartments]:
    """Return the non-empty subsets of a world's split."""
    split = _plans(OmegaConf.select(cfg, world.split))
    return [Apartments(cfg, subset, world) for subset in PARTS if split[subset]]


_READ: dict[str, Mapping[str, list[FloorPlan]]] = {}
_MORE: dict[str, list[FloorPlan]] = {}
_CELLS: dict[str, int] = {}
_HASHES: dict[int, tuple[FloorPlan, str]] = {}


def _plans(split: DictConfig) -> Mapping[str, list[FloorPlan]]:
    # stages ask for the same plans many times in one command
    key = canonical(split)
    if key not in _READ:
        _READ[key] = load_split(typed(split))
    return _READ[key]


def _more_training(split: DictConfig, count: int) -> list[FloorPlan]:
    key = canonical([split, count])
    if key not in _MORE:
        _MORE[key] = more_training(typed(split), count)
    return _MORE[key]


def plan_hash(plan: FloorPlan) -> str:
    """Return the SHA-256 of a floor plan, in hex."""
    if id(plan) not in _HASHES:
        _HASHES[id(plan)] = (plan, floor_plan_hash(plan))  # the plan, so that its id stays its own
    return _HASHES[id(plan)][1]


def cells_of(plan: FloorPlan) -> int:
    """Return the number of free cells of an apartment."""
    key = plan_hash(plan)
    if key not in _CELLS:
        _CELLS[key] = build_grid(plan).cells
    return _CELLS[key]


class PerApartment(Stage):
    """Stage with one file per apartment.

    The fingerprint of a file depends on its own apartment only, so other apartments may be added to
    the split without rebuilding it.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    apartments : Apartments
        Apartments of the files.
    """

    def __init__(self, cfg: DictConfig, apartments: Apartments) -> None:
        super().__init__(cfg)
        self.apartments = apartments

    def consulted(self) -> Sequence[str]:
        """Return the keys of the split; the fingerprint holds its floor plans instead."""
        return self.apartments.keys

    @property
    def folder(self) -> Path:
        """Parent of the apartments' folders."""
        return Path(self.cfg.outputs) / "generate"

    @cached_property
    def fingerprints(self) -> list[str]:
        """Fingerprint of each apartment's file."""
        plans, needs = self.apartments.plans, self.needed
        inputs = self.inputs()
        return [
            digest(
                self.kind,
                self.version,
                inputs,
                self.content(),
                self.content_of(plan),
                [_of_apartment(need, self.apartments, index) for need in needs],
                *self.numerics(),
            )
            for index, plan in enumerate(plans)
        ]

    @cached_property
    def fingerprint(self) -> str:
        """Fingerprint of all files together."""
        return digest(self.fingerprints)

    def content_of(self, plan: FloorPlan) -> Any:
        """Return further content of the fingerprint of an apartment's file."""
        return None

    @abstractmethod
    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """Return the path of an apartment's file."""

    @property
    def paths(self) -> list[Path]:
        """Paths of the files, in the order of the apartments."""
        pairs = zip(self.apartments.plans, self.fingerprints, strict=True)
        return [self.path_of(plan, fingerprint) for plan, fingerprint in pairs]

    def locks(self) -> Sequence[Path]:
        """Return the missing files; sorted, so that two processes never wait for each other."""
        return sorted(path for path in self.paths if not path.is_file())

    def missing(self) -> list[int]:
        """Return the indices of the apartments without a file."""
        return [index for index, path in enumerate(self.paths) if not path.is_file()]

    def discard(self) -> None:
        """Delete the files of all apartments."""
        for path in self.paths:
            path.unlink(missing_ok=True)

    def cells_left(self) -> int:
        """Return the number of free cells of the apartments without a file."""
        return sum(cells_of(self.apartments.plans[index]) for index in self.missing())

    def pairs_left(self) -> int:
        """Return the number of pairs of source and free cell of these apartments."""
        plans = [self.apartments.plans[index] for index in self.missing()]
        return sum(len(plan.sources) * cells_of(plan) for plan in plans)

    def begun(self) -> bool:
        """Return whether an apartment has temporary files of an interrupted attempt."""
        return any(partial_folder(self.paths[index]).is_dir() for index in self.missing())

    def done(self) -> bool:
        """Return whether each apartment has its file."""
        return not self.missing()


def _of_apartment(need: Stage, apartments: Apartments, index: int) -> str:
    if isinstance(need, PerApartment) and need.apartments == apartments:
        return need.fingerprints[index]
    return need.fingerprint


def scene_folder(cfg: DictConfig, plan: FloorPlan) -> Path:
    """Return an apartment's folder, `outputs/generate/<apartment>-<hash8 of its floor plan>`."""
    if not cfg.outputs:
        raise UserError("outputs: empty; give the path of a folder")
    return Path(cfg.outputs) / "generate" / f"{plan.name}-{plan_hash(plan)[:8]}"


def check_processes(cfg: DictConfig) -> None:
    """Raise `UserError` where `processes` is less than 1."""
    if cfg.processes < 1:
        raise UserError(f"processes: {cfg.processes} is less than 1; give 1 or more")
