"""Stages: products of the pipeline with declared dependencies, cached by fingerprint.

A stage declares the stages that it needs, the settings that it reads, and how it is made. Its
fingerprint follows from these: equal configs share one product, and a change of a setting rebuilds
only the products that read it. The plan of a command, the estimate of its duration and the settings
that it does not read follow too.
"""

from __future__ import annotations

import shutil
import time
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.core.files import locked, writing
from avn.core.hashing import digest
from avn.core.numerics import NATIVE
from avn.core.progress import format_duration, log, working
from avn.core.settings import leaves, values
from avn.core.sources import outside_sources
from avn.pipeline.estimates import expected, record

# Settings that every stage reads and that change no product.
MACHINE = ("outputs", "processes", "auto", "force")
# Seconds that this process took for each stage that it made, by title.
timings: dict[str, float] = {}


class Stage(ABC):
    """Product of the pipeline.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.

    Attributes
    ----------
    kind : str
        Name of the kind of product, part of the fingerprint.
    version : int
        Version of the product; raised when its code changes the product.
    """

    kind: ClassVar[str]
    version: ClassVar[int] = 1

    def __init__(self, cfg: DictConfig) -> None:
        self.cfg = cfg

    # Declared by subclasses.

    def needs(self) -> Sequence[Stage]:
        """Return the stages that it depends on; their fingerprints enter its own."""
        return ()

    def settings(self) -> Sequence[str]:
        """Return the dotted keys, nodes or leaves, whose values enter the fingerprint."""
        return ()

    def ignored(self) -> Sequence[str]:
        """Return the keys below those of `settings` that the product does not depend on."""
        return ()

    def consulted(self) -> Sequence[str]:
        """Return the keys that it reads and whose values are not in the fingerprint.

        Either they change no product, such as labels, or `content` holds what they refer to.
        """
        return ()

    def content(self) -> Any:
        """Return further content of the fingerprint: floor plans, hashes of files, arguments."""
        return None

    @property
    @abstractmethod
    def title(self) -> str:
        """Title of the product, for messages."""

    @property
    @abstractmethod
    def folder(self) -> Path:
        """Folder of the product, which may not exist yet."""

    def seconds(self) -> float:
        """Estimate the duration of what is missing, on two cores, in seconds, without its needs."""
        return 0.0

    def begun(self) -> bool:
        """Return whether an interrupted attempt has made a part of it."""
        return False

    def check(self) -> None:
        """Raise `UserError` for settings that cannot work, before anything is built."""
        return

    def by_products(self) -> Sequence[Stage]:
        """Return the stages whose products are written when this one is made."""
        return ()

    @abstractmethod
    def done(self) -> bool:
        """Return whether the product exists; it is checked for damage on reading."""

    @abstractmethod
    def make(self) -> None:
        """Make what is missing of the product, given its needs; resumes after an interruption."""

    def load(self) -> Any:
        """Read the product.

        Raises
        ------
        UserError
            Where it is missing or damaged.
        """
        raise TypeError(f"{self.kind} is read by the stages that need it")

    # Derived from the above.

    @cached_property
    def needed(self) -> tuple[Stage, ...]:
        """Result of `needs`, cached."""
        return tuple(self.needs())

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of all that the product depends on, in hex."""
        needed = [need.fingerprint for need in self.needed]
        own = (self.kind, self.version, self.inputs(), self.content())
        return digest(*own, needed, *self.numerics())

    def numerics(self) -> list[str]:
        """Return the numerics for the fingerprint, where they are not the default."""
        return [] if self.cfg.numerics == NATIVE else [str(self.cfg.numerics)]

    def inputs(self) -> list[Any]:
        """Return the values of the settings, and hashes of the classes from outside among them."""
        return with_sources(values(self.cfg, self.settings(), self.ignored()))

    def discard(self) -> None:
        """Delete the product, so that it is made anew."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def expected(self) -> float:
        """Return its `seconds`, corrected by the durations of its kind on this machine."""
        return expected(self.cfg.outputs, self.kind, self.seconds())

    def locks(self) -> Sequence[Path]:
        """Return the paths that only one process may write at a time, in a fixed order."""
        return (self.folder,)

    def read(self) -> set[str]:
        """Return the leaf keys of the config that this stage and all its dependencies read."""
        return set().union(*(stage.read_here() for stage in with_needs([self])))

    def read_here(self) -> set[str]:
        """Return the leaf keys of the config that this stage reads, without its dependencies."""
        keys = (*MACHINE, "numerics", *self.settings(), *self.consulted())
        return leaves(self.cfg, keys, self.ignored())


def with_sources(settings: list[Any]) -> list[Any]:
    """Return some settings, and the hashes of the classes from outside that they name, if any."""
    sources = outside_sources(settings)
    return [*settings, sources] if sources else settings


def with_needs(stages: Iterable[Stage]) -> list[Stage]:
    """Return some stages and all that they depend on, each once."""
    visited: dict[str, Stage] = {}
    left = list(stages)
    while left:
        stage = left.pop()
        if stage.fingerprint not in visited:
            visited[stage.fingerprint] = stage
            left.extend(stage.needed)
    return list(visited.values())


def missing(stages: Iterable[Stage]) -> list[Stage]:
    """Return the stages to make for some stages, themselves included, each once and in order.

    Nothing is written. The dependencies of a stage that is done are not examined.

    Raises
    ------
    UserError
        Where settings of one of them cannot work.
    """
    wanted = list(stages)
    ordered = _ordered(wanted, {})
    writers = {product.fingerprint: stage for stage in ordered for product in stage.by_products()}
    # the stage that writes a by-product replaces it, so that it is not made twice
    return _ordered(wanted, writers) if writers else ordered


def _ordered(stages: Iterable[Stage], instead: Mapping[str, Stage]) -> list[Stage]:
    ordered: dict[str, Stage] = {}

    def collect(stage: Stage) -> None:
        stage = instead.get(stage.fingerprint, stage)
        if stage.fingerprint in ordered or stage.done():
            return
        stage.check()
        for need in stage.needed:
            collect(need)
        ordered[stage.fingerprint] = stage

    for stage in stages:
        collect(stage)
    return list(ordered.values())


def build(stage: Stage, explicit: bool = False) -> None:
    """Make a stage and its dependencies where they are missing.

    Parameters
    ----------
    stage : Stage
        Stage to make.
    explicit : bool
        Whether the user asked for this product: then `auto=false` does not refuse to make it, and
        `force=true` makes it anew.

    Raises
    ------
    UserError
        Where a product is missing and `auto` is false, or settings cannot work.
    """
    if explicit:
        discard_if_forced([stage])
    steps, asked_for = missing([stage]), {stage.fingerprint} if explicit else set()
    announce(steps, asked_for)
    for step in steps:
        make(step, explicit=step.fingerprint in asked_for)


def announce(steps: Sequence[Stage], asked_for: Collection[str]) -> None:
    """Print the stages to make and their expected durations, if there are several.

    Parameters
    ----------
    steps : sequence of Stage
        Result of `missing`.
    asked_for : collection of str
        Fingerprints of the stages that may be made where `auto` is false.

    Raises
    ------
    UserError
        Where another stage is missing and `auto` is false.
    """
    for step in steps:
        if not (step.cfg.auto or step.fingerprint in asked_for):
            raise missing_error(step)
    if len(steps) > 1:
        for step in steps:
            log(f"to make: {step.title} (about {format_duration(step.expected())})")
        total = sum(step.expected() for step in steps)
        log(f"all in all about {format_duration(total)}")


def discard_if_forced(stages: Iterable[Stage]) -> None:
    """Delete finished products whose config has `force=true`."""
    for stage in stages:
        if stage.cfg.force and stage.done():
            stage.check()  # a command that cannot work deletes nothing
            with ExitStack() as held:
                for path in stage.locks():
                    held.enter_context(locked(path, stage.title))
                stage.discard()


def make(stage: Stage, explicit: bool = False) -> None:
    """Make a stage whose needs exist, unless it is done; wait where another process makes it."""
    if stage.done():
        return
    if not (stage.cfg.auto or explicit):
        raise missing_error(stage)
    with ExitStack() as held:
        for path in stage.locks():
            held.enter_context(locked(path, stage.title))
        if stage.done():
            return
        planned, whole = stage.seconds(), not stage.begun()
        about = f" (about {format_duration(stage.expected())})" if planned else ""
        log(f"{stage.title} is missing: making it{about}")
        started = time.perf_counter()
        with working(stage.title), writing(stage.folder):
            stage.make()
        took = time.perf_counter() - started
        timings[stage.title] = timings.get(stage.title, 0.0) + took
        if whole:
            record(stage.cfg.outputs, stage.kind, planned, took)
        log(f"{stage.title} made in {format_duration(took)}: {stage.folder}")


def missing_error(stage: Stage) -> UserError:
    """Return the error for a missing product that must not be made."""
    return UserError(
        f"{stage.folder}: {stage.title} is missing and auto=false; leave auto=true to make it"
    )
