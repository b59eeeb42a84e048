"""Stages: products of the pipeline with declared dependencies, cached by fingerprint.

A stage declares the stages that it needs, the settings that it reads, and how it is made. Its
fingerprint follows from these: equal configs share one product, and a change of a setting rebuilds
only the products that read it. The plan of a command, the estimate of its duration and the settings
that it does not read follow too.
"""

from __future__ import annotations

import shutil
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from omegaconf import DictConfig

from avn.core.hashing import digest
from avn.core.numerics import NATIVE
from avn.core.settings import leaves, values
from avn.core.sources import outside_sources
from avn.pipeline.estimates import expected

# Settings that every stage reads and that change no product.
MACHINE = ("outputs", "processes", "auto", "force")


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

    @property
    def timed_as(self) -> str:
        """Stages whose durations correct the estimate of this one have the same name here."""
        return self.kind

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
        return expected(self.cfg.outputs, self.timed_as, self.seconds())

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
