"""Training of an actor-critic in rounds, with validation and a checkpoint after each."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.core.progress import log, progress_bar
from avn.rl.checkpoints import (
    BEST,
    CURVE,
    LAST,
    damaged,
    read_checkpoint,
    read_start,
    save_network,
)
from avn.rl.curve import best_of
from avn.rl.networks import ActorCritic
from avn.rl.shared import SharedState, flatten_parameters
from avn.rl.worker import TrainingSpec
from avn.rl.worker_pool import start_pool

if TYPE_CHECKING:
    from lightning.pytorch.loggers import Logger

Measure = Callable[[ActorCritic], dict[str, float]]


class Training:
    """Training that resumes from its last checkpoint.

    Parameters
    ----------
    spec : TrainingSpec
        Apartments, protocol, network and algorithm.
    network : ActorCritic
        Gives the initial weights, and holds those of the last round afterwards.
    folder : Path
        Folder of checkpoints and TensorBoard events.
    measure : callable
        Returns the validation metrics of a network by name, including `avn.rl.curve.MONITOR`.
    fingerprint : str
        Hash of all settings and data of the training, stored in checkpoints.
    loggers : callable, optional
        Returns the loggers of the training, given its first step.
    start : Path, optional
        Last checkpoint of another training, from which this one goes on: weights, moments, number
        of actions.

    Attributes
    ----------
    curve : list of dict
        Metrics of each round by name; the first entry is the untrained network.

    Raises
    ------
    UserError
        If the last checkpoint is damaged or belongs to another training, or `start` does not fit.
    """

    def __init__(
        self,
        spec: TrainingSpec,
        network: ActorCritic,
        folder: Path,
        measure: Measure,
        fingerprint: str,
        loggers: Callable[[int], Sequence[Logger]] = lambda step: (),
        start: Path | None = None,
    ) -> None:
        self._open_loggers = loggers
        self.spec, self.network, self.folder = spec, network, folder
        self.measure, self.fingerprint = measure, fingerprint
        self._weights, _ = flatten_parameters(network)
        self.shared = SharedState.of(self._weights)
        self.curve: list[dict[str, float]] = []
        self._states: list[dict[str, Any]] = []
        # batches of the training from which this one goes on
        self._before = 0
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / LAST).is_file():
            self._resume()
        elif start is not None:
            self._go_on_from(start)

    def run(self, rounds: int | None = None) -> list[dict[str, float]]:
        """Train to the end, or for a number of rounds.

        Parameters
        ----------
        rounds : int, optional
            Largest number of further rounds.

        Returns
        -------
        list of dict
            Metrics of each round by name; the first entry is the untrained network.

        Raises
        ------
        UserError
            If a worker dies, or the training diverges.
        """
        recipe = self.spec.recipe
        updates = max(1, recipe.total_steps // (recipe.batch * recipe.workers))
        updates -= self._before // recipe.workers
        planned = max(1, round(updates * recipe.batch * recipe.workers / recipe.validate_every))
        each = -(-updates // min(planned, updates))
        last = -(-updates // each)
        if rounds is not None:
            last = min(last, len(self._rounds()) + rounds)
        bar = progress_bar(
            f"training of {self.folder.name}",
            self._before + updates * recipe.workers,
            "batches",
            self._batches,
        )
        loggers = self._open_loggers(self.steps + 1)
        try:
            with bar as advance:
                if not self.curve:
                    self._end_round({}, loggers)
                if len(self._rounds()) < last:
                    self._go(last, each, updates, loggers, advance)
        finally:
            for logger in loggers:
                logger.finalize("success" if len(self._rounds()) >= last else "failed")
        return self.curve

    @property
    def steps(self) -> int:
        """Number of actions that were learnt from."""
        return self._batches * self.spec.recipe.batch

    @property
    def _batches(self) -> int:
        return int(self.shared.updates) // self.spec.recipe.updates_per_batch

    def _rounds(self) -> list[dict[str, float]]:
        """Return the entries of the curve after that of the untrained network."""
        return self.curve[1:]

    def _go(
        self,
        last: int,
        each: int,
        updates: int,
        loggers: Sequence[Logger],
        advance: Callable[[int], None],
    ) -> None:
        shown = self._batches

        def progress() -> None:
            nonlocal shown
            done = self._batches
            advance(done - shown)
            shown = done

        pool = start_pool(self.spec, self.shared, self._states, self.folder)
        try:
            for number in range(len(self._rounds()), last):
                started, before = time.perf_counter(), self.steps
                todo = min(each, updates - number * each)
                reports = pool.run_chunk(todo, progress)
                seconds = time.perf_counter() - started
                self._states = [state for _, state in reports]
                metrics = _mean([found for found, _ in reports])
                metrics["steps_per_second"] = (self.steps - before) / seconds
                self._end_round(metrics, loggers)
        finally:
            pool.close()

    def _end_round(self, metrics: dict[str, float], loggers: Sequence[Logger]) -> None:
        """Validate, save the best network, log, and write the checkpoint."""
        if not self.shared.weights.isfinite().all():
            raise UserError(
                f"{self.folder.name}: its weights are not finite after {self.steps} steps; the "
                "checkpoint before is kept; give a lower algorithm.lr or algorithm.max_grad_norm"
            )
        self._weights.copy_(self.shared.weights)
        found = {"steps": float(self.steps), **metrics, **self.measure(self.network)}
        self.curve.append(found)
        if best_of(self.curve) is found:
            self._write(BEST, save_network(self.network, self.fingerprint))
        curves = {
            name if "/" in name else f"steps/{name}": value
            for name, value in found.items()
            if name != "steps"
        }
        for logger in loggers:
            logger.log_metrics(curves, self.steps)
            logger.save()
        shared = {key: getattr(self.shared, key).clone() for key in ("weights", "moments")}
        self._write(
            LAST,
            {
                "fingerprint": self.fingerprint,
                **shared,
                "updates": int(self.shared.updates),
                "workers": self._states,
                "curve": self.curve,
                "before": self._before,
            },
        )
        with atomic_write(self.folder / CURVE) as part:
            part.write_text(json.dumps(self.curve, indent=1) + "\n")

    def _write(self, name: str, content: dict[str, Any]) -> None:
        # by a file of Python, whose errors say why they happened
        with atomic_write(self.folder / name) as part, part.open("wb") as file:
            torch.save(content, file)

    def _resume(self) -> None:
        path = self.folder / LAST
        kept = read_checkpoint(path, self.fingerprint)
        try:
            self.shared.weights.copy_(kept["weights"])
            self.shared.moments.copy_(kept["moments"])
            self.shared.updates.fill_(kept["updates"])
            self._weights.copy_(kept["weights"])
            self._states, self.curve = kept["workers"], kept["curve"]
            self._before = kept.get("before", 0)
        except (KeyError, RuntimeError) as error:
            raise damaged(path) from error
        log(f"{path}: going on after {self.steps} steps")

    def _go_on_from(self, path: Path) -> None:
        kept = read_start(path, self.spec.recipe)
        sizes = {name: getattr(self.shared, name).shape for name in ("weights", "moments")}
        if any(kept[name].shape != size for name, size in sizes.items()):
            raise UserError(
                f"ckpt_path: {path} is of another network, with {len(kept['weights'])} "
                f"weights, and this one has {len(self.shared.weights)}"
            )
        for name in sizes:
            getattr(self.shared, name).copy_(kept[name])
        self.shared.updates.fill_(kept["updates"])
        self._before = self._batches


def _mean(metrics: list[dict[str, float]]) -> dict[str, float]:
    names = dict.fromkeys(name for own in metrics for name in own)
    found = {}
    for name in names:
        values = [own[name] for own in metrics if name in own]
        found[name] = sum(values) / len(values)
    return found
