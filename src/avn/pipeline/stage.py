"""Stages: products that are made once, each declared in one place.

A stage says which stages it needs, which settings it reads, and how it is made. Its fingerprint
follows from these: equal configs share one product, and a setting that a product does not read
never makes it anew. The plan of a command follows too, and with it the time that is left and
which settings of a config nothing reads.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.core.files import locked
from avn.core.hashing import digest
from avn.core.progress import format_duration, log
from avn.core.settings import leaves, values

# What every stage reads besides its own settings; none of it changes a product.
MACHINE = ("outputs", "processes", "auto")
# Seconds that each stage took that this process made, by title.
spent: dict[str, float] = {}


class Stage(ABC):
    """A product of the pipeline.

    Parameters
    ----------
    cfg : DictConfig
        The config of a command.

    Attributes
    ----------
    kind : str
        Names the product among all kinds, and its folder below `outputs`.
    version : int
        Raised when the code of the stage changes its product.
    """

    kind: ClassVar[str]
    version: ClassVar[int] = 1

    def __init__(self, cfg: DictConfig) -> None:
        self.cfg = cfg

    # What is declared.

    def needs(self) -> Sequence[Stage]:
        """Stages without which it cannot be made; their fingerprints enter its own."""
        return ()

    def settings(self) -> Sequence[str]:
        """Dotted keys of the config whose values enter the fingerprint, whole nodes or leaves."""
        return ()

    def ignored(self) -> Sequence[str]:
        """Keys below those of `settings` that this product does not read."""
        return ()

    def consulted(self) -> Sequence[str]:
        """Keys that it reads and whose values stay out of the fingerprint.

        Either they change no product, such as labels, or `content` holds what they stand for.
        """
        return ()

    def content(self) -> Any:
        """What enters the fingerprint besides: floor plans, hashes of files, own arguments."""
        return None

    @property
    @abstractmethod
    def title(self) -> str:
        """What it is, for the lines that the user reads."""

    @property
    @abstractmethod
    def folder(self) -> Path:
        """Where it lies, or will."""

    def seconds(self) -> float:
        """How long it takes on two cores, roughly, once all that it needs is there."""
        return 0.0

    def check(self) -> None:
        """Raise `UserError` for settings that cannot work, before anything is made."""
        return

    def by_products(self) -> Sequence[Stage]:
        """Stages whose products are written along the way when this one is made."""
        return ()

    @abstractmethod
    def done(self) -> bool:
        """Whether the product is there; whether it is whole shows on reading."""

    @abstractmethod
    def make(self) -> None:
        """Make what is missing of it, on needs that are there; goes on where it was killed."""

    def load(self) -> Any:
        """The product, read from where it lies.

        Raises
        ------
        UserError
            Where it is missing or damaged.
        """
        raise TypeError(f"{self.kind} is read by the stages that need it")

    # What follows.

    @cached_property
    def needed(self) -> tuple[Stage, ...]:
        """What `needs` says, asked once."""
        return tuple(self.needs())

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256, in hex, of all that the product depends on."""
        own = values(self.cfg, self.settings(), self.ignored())
        needed = [need.fingerprint for need in self.needed]
        return digest(self.kind, self.version, own, self.content(), needed)

    def locks(self) -> Sequence[Path]:
        """Paths that only one process may be making at a time, in a fixed order."""
        return (self.folder,)

    def read(self) -> set[str]:
        """Leaf keys of the config that this stage and all that it needs read."""
        every: dict[str, Stage] = {}
        left: list[Stage] = [self]
        while left:
            stage = left.pop()
            if stage.fingerprint not in every:
                every[stage.fingerprint] = stage
                left.extend(stage.needed)
        return set().union(*(stage.read_here() for stage in every.values()))

    def read_here(self) -> set[str]:
        """Leaf keys of the config that this stage reads, without what it needs."""
        keys = (*MACHINE, *self.settings(), *self.consulted())
        return leaves(self.cfg, keys, self.ignored())


def missing(stages: Iterable[Stage]) -> list[Stage]:
    """What must be made for some stages, themselves included, each once and in order.

    Writes nothing. Stages below one that is done are not looked at.

    Raises
    ------
    UserError
        Where settings of one of them cannot work.
    """
    wanted = list(stages)
    found = _ordered(wanted, {})
    along = {own.fingerprint: stage for stage in found for own in stage.by_products()}
    # who writes a by-product takes its place, so that nobody makes it twice
    return _ordered(wanted, along) if along else found


def _ordered(stages: Iterable[Stage], instead: Mapping[str, Stage]) -> list[Stage]:
    found: dict[str, Stage] = {}

    def collect(stage: Stage) -> None:
        stage = instead.get(stage.fingerprint, stage)
        if stage.fingerprint in found or stage.done():
            return
        stage.check()
        for need in stage.needed:
            collect(need)
        found[stage.fingerprint] = stage

    for stage in stages:
        collect(stage)
    return list(found.values())


def build(stage: Stage, explicit: bool = False) -> None:
    """Make a stage and what it needs, as far as it is missing.

    Parameters
    ----------
    explicit : bool
        Whether it is this product that the user asked for: then `auto=false`, which refuses to
        make what is missing, does not refuse this one.

    Raises
    ------
    UserError
        Where something is missing and `auto` is false, or settings cannot work.
    """
    for own in missing([stage]):
        make(own, explicit=explicit and own.fingerprint == stage.fingerprint)


def make(stage: Stage, explicit: bool = False) -> None:
    """Make a stage whose needs are there, unless it is done or another process makes it."""
    if stage.done():
        return
    if not (stage.cfg.auto or explicit):
        raise missing_error(stage)
    with ExitStack() as held:
        for path in stage.locks():
            held.enter_context(locked(path, stage.title))
        if stage.done():
            return
        about = f" (about {format_duration(stage.seconds())})" if stage.seconds() else ""
        log(f"{stage.title} is missing: making it{about}")
        started = time.perf_counter()
        stage.make()
        took = time.perf_counter() - started
        spent[stage.title] = spent.get(stage.title, 0.0) + took
        log(f"{stage.title} made in {format_duration(took)}: {stage.folder}")


def missing_error(stage: Stage) -> UserError:
    """The error where something is missing that must not be made."""
    return UserError(
        f"{stage.folder}: {stage.title} is missing and auto=false; leave auto=true to make it"
    )
