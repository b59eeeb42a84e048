"""Apartments of the test world or of the training world, and stages with a file for each of them.

The test world is where agents are evaluated, the training world where networks are trained. By
default both have the same split and the same acoustics.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid
from avn.apartments.splits import PARTS, load_split
from avn.core.errors import UserError
from avn.core.files import check_name
from avn.core.hashing import digest
from avn.core.settings import typed, values
from avn.pipeline.stage import Stage


@dataclass(frozen=True)
class World:
    """The keys of the config that describe a world.

    Attributes
    ----------
    split, acoustics, microphone, sounds : str
        Its apartments, how sound spreads in them, what records it, and which sounds there are.
    """

    split: str
    acoustics: str
    microphone: str
    sounds: str


TEST = World("split", "acoustics", "microphone", "sound")
TRAINING = World("training.scenes", "training.acoustics", "training.microphone", "training.sounds")


@dataclass(frozen=True)
class Apartments:
    """The apartments of one part of a world's split.

    Attributes
    ----------
    cfg : DictConfig
    part : {"train", "validation", "test"}
    world : World
    """

    cfg: DictConfig = field(compare=False, repr=False)
    part: str
    world: World = TEST

    @property
    def plans(self) -> list[FloorPlan]:
        """Their floor plans.

        Raises
        ------
        UserError
            Where there are none, or the split cannot be read.
        """
        split = OmegaConf.select(self.cfg, self.world.split)
        check_name(f"{self.world.split}.name", split.name)
        plans = _plans(split)[self.part]
        if not plans:
            where = f" in {split.folder}" if split.folder else ""
            raise UserError(
                f"{self.world.split}.{self.part} is empty: no floor plan of that part{where}; "
                "add one (train_*.json, val_*.json, any other name for test)"
            )
        return plans

    @property
    def cells(self) -> int:
        """How many free cells they have together."""
        return sum(cells_of(plan) for plan in self.plans)

    @property
    def pairs(self) -> int:
        """How many pairs of source and free cell they have together."""
        return sum(len(plan.sources) * cells_of(plan) for plan in self.plans)

    def node(self, name: str) -> Any:
        """The node of the config that the world has under a name, such as `acoustics`."""
        return OmegaConf.select(self.cfg, getattr(self.world, name))

    @property
    def title(self) -> str:
        """What they are, for titles of stages."""
        return f"the {self.part} apartments of '{self.node('split').name}'"


def apartments_of_every_part(cfg: DictConfig, world: World = TEST) -> list[Apartments]:
    """The parts of a world's split that have apartments."""
    split = _plans(OmegaConf.select(cfg, world.split))
    return [Apartments(cfg, part, world) for part in PARTS if split[part]]


_READ: dict[str, dict[str, list[FloorPlan]]] = {}
_CELLS: dict[str, int] = {}
_HASHES: dict[int, tuple[FloorPlan, str]] = {}


def _plans(split: DictConfig) -> dict[str, list[FloorPlan]]:
    # stages ask for the same plans many times in one command
    key = OmegaConf.to_yaml(split, resolve=True)
    if key not in _READ:
        _READ[key] = load_split(typed(split))
    return _READ[key]


def plan_hash(plan: FloorPlan) -> str:
    """SHA-256, in hex, of a floor plan."""
    if id(plan) not in _HASHES:
        _HASHES[id(plan)] = (plan, digest(plan.to_dict()))  # the plan, so that its id stays its own
    return _HASHES[id(plan)][1]


def cells_of(plan: FloorPlan) -> int:
    """How many free cells an apartment has."""
    key = plan_hash(plan)
    if key not in _CELLS:
        _CELLS[key] = build_grid(plan).cells
    return _CELLS[key]


class PerApartment(Stage):
    """A stage that leaves one file for each apartment.

    The fingerprint of a file depends on its own apartment only, so that another apartment in the
    split makes none of them anew.

    Parameters
    ----------
    cfg : DictConfig
    apartments : Apartments
    """

    def __init__(self, cfg: DictConfig, apartments: Apartments) -> None:
        super().__init__(cfg)
        self.apartments = apartments

    def consulted(self) -> Sequence[str]:
        """The split, whose floor plans are in the fingerprint."""
        return (self.apartments.world.split,)

    @property
    def folder(self) -> Path:
        """Where the folders of the apartments lie."""
        return Path(self.cfg.outputs) / "generate"

    @cached_property
    def fingerprints(self) -> list[str]:
        """The fingerprint of each apartment's file."""
        plans, needs = self.apartments.plans, self.needed
        own = values(self.cfg, self.settings(), self.ignored())
        return [
            digest(
                self.kind,
                self.version,
                own,
                self.content(),
                self.content_of(plan),
                [_of_apartment(need, self.apartments, index) for need in needs],
            )
            for index, plan in enumerate(plans)
        ]

    @cached_property
    def fingerprint(self) -> str:
        """The fingerprint of all files together."""
        return digest(self.fingerprints)

    def content_of(self, plan: FloorPlan) -> Any:
        """What enters the fingerprint of an apartment's file besides."""
        return None

    @abstractmethod
    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """The file of an apartment."""

    @property
    def paths(self) -> list[Path]:
        """The files, in the order of the apartments."""
        pairs = zip(self.apartments.plans, self.fingerprints, strict=True)
        return [self.path_of(plan, own) for plan, own in pairs]

    def locks(self) -> Sequence[Path]:
        """The files that are missing; sorted, so that two processes never wait for each other."""
        return sorted(path for path in self.paths if not path.is_file())

    def missing(self) -> list[int]:
        """Which apartments have no file yet, by number."""
        return [index for index, path in enumerate(self.paths) if not path.is_file()]

    def done(self) -> bool:
        """Whether each apartment has its file."""
        return not self.missing()


def _of_apartment(need: Stage, apartments: Apartments, index: int) -> str:
    if isinstance(need, PerApartment) and need.apartments == apartments:
        return need.fingerprints[index]
    return need.fingerprint


def scene_folder(cfg: DictConfig, plan: FloorPlan) -> Path:
    """The folder of an apartment: `outputs/generate/<apartment>-<hash8 of its floor plan>`."""
    if not cfg.outputs:
        raise UserError("outputs: empty; give the path of a folder")
    return Path(cfg.outputs) / "generate" / f"{plan.name}-{plan_hash(plan)[:8]}"


def check_processes(cfg: DictConfig) -> None:
    """Raise `UserError` where `processes` is less than 1."""
    if cfg.processes < 1:
        raise UserError(f"processes: {cfg.processes} is less than 1; give 1 or more")
