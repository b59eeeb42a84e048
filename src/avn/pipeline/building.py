"""Making of stages: what is missing, in which order it is made, and how long that takes."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack

from avn.core.errors import UserError
from avn.core.files import locked, writing
from avn.core.progress import format_duration, log, working
from avn.pipeline.estimates import record
from avn.pipeline.stage import Stage

# Seconds that this process took for each stage that it made, by title.
timings: dict[str, float] = {}


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
            record(stage.cfg.outputs, stage.timed_as, planned, took)
        log(f"{stage.title} made in {format_duration(took)}: {stage.folder}")


def missing_error(stage: Stage) -> UserError:
    """Return the error for a missing product that must not be made."""
    return UserError(
        f"{stage.folder}: {stage.title} is missing and auto=false; leave auto=true to make it"
    )
