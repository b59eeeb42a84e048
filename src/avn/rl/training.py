"""Training of an actor-critic: chunks of updates, with measurement and checkpoint between them."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from torch.utils.tensorboard import SummaryWriter

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.core.progress import log, progress_bar
from avn.rl.networks import ActorCritic
from avn.rl.shared import SharedState, flatten_parameters
from avn.rl.worker import TrainingSpec
from avn.rl.worker_pool import start_pool

LAST, BEST, CURVE = "last.ckpt", "best.ckpt", "curve.json"
# By which figure the best network is chosen.
MONITOR = "validation/spl"
Measure = Callable[[ActorCritic], dict[str, float]]


class Training:
    """A training that goes on where it was.

    Parameters
    ----------
    spec : Task
    network : ActorCritic
        Its weights are the first ones; afterwards they are those of the last round.
    folder : Path
        Where checkpoints and TensorBoard's events lie.
    measure : callable
        Figures of a network by name, `MONITOR` among them.
    made_from : str
        Hash of all that the training depends on, for the checkpoints.

    Raises
    ------
    UserError
        Where the last checkpoint belongs to another training, or is damaged.
    """

    def __init__(
        self,
        spec: TrainingSpec,
        network: ActorCritic,
        folder: Path,
        measure: Measure,
        made_from: str,
    ) -> None:
        self.spec, self.network, self.folder = spec, network, folder
        self.measure, self.made_from = measure, made_from
        self._weights, _ = flatten_parameters(network)
        self.shared = SharedState.of(self._weights)
        self.curve: list[dict[str, float]] = []
        self._states: list[dict[str, Any]] = []
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / LAST).is_file():
            self._resume()

    def run(self, rounds: int | None = None) -> list[dict[str, float]]:
        """Train to the end, or so many rounds; gives the figures of each round.

        Raises
        ------
        UserError
            Where a worker dies.
        """
        recipe = self.spec.recipe
        updates = max(1, recipe.total_steps // (recipe.batch * recipe.workers))
        planned = max(1, round(recipe.total_steps / recipe.validate_every))
        each = -(-updates // min(planned, updates))
        last = -(-updates // each)
        if rounds is not None:
            last = min(last, len(self._rounds()) + rounds)
        with SummaryWriter(str(self.folder), purge_step=self.steps + 1) as writer:
            if not self.curve:
                self._close_round({}, writer)
            if len(self._rounds()) < last:
                self._go(last, each, updates, writer)
        return self.curve

    @property
    def steps(self) -> int:
        """Actions that were learnt from."""
        return self._batches * self.spec.recipe.batch

    @property
    def _batches(self) -> int:
        return int(self.shared.updates) // self.spec.recipe.updates_per_batch

    def _rounds(self) -> list[dict[str, float]]:
        """The rounds that were made; the curve begins with the untrained network."""
        return self.curve[1:]

    def _go(self, last: int, each: int, updates: int, writer: SummaryWriter) -> None:
        recipe = self.spec.recipe
        pool = start_pool(self.spec, self.shared, self._states)
        try:
            with progress_bar(self.folder.name, updates * recipe.workers, "batches") as advance:
                shown = 0

                def progress() -> None:
                    nonlocal shown
                    done = self._batches
                    advance(done - shown)
                    shown = done

                progress()
                for number in range(len(self._rounds()), last):
                    started, before = time.perf_counter(), self.steps
                    todo = min(each, updates - number * each)
                    reports = pool.run_chunk(todo, progress)
                    seconds = time.perf_counter() - started
                    self._states = [state for _, state in reports]
                    figures = _mean([found for found, _ in reports])
                    figures["steps_per_second"] = (self.steps - before) / seconds
                    self._close_round(figures, writer)
        finally:
            pool.close()

    def _close_round(self, figures: dict[str, float], writer: SummaryWriter) -> None:
        """Measure, keep the best, log, and write the checkpoint."""
        self._weights.copy_(self.shared.weights)
        found = {"steps": float(self.steps), **figures, **self.measure(self.network)}
        best = max((own[MONITOR] for own in self.curve), default=float("-inf"))
        self.curve.append(found)
        if found[MONITOR] > best:
            self._write(BEST, save_network(self.network, self.made_from))
        for name, value in found.items():
            if name != "steps":
                group = name if "/" in name else f"train/{name}"
                writer.add_scalar(group, value, self.steps)
        writer.flush()
        shared = {key: getattr(self.shared, key).clone() for key in ("weights", "moments")}
        self._write(
            LAST,
            {
                "made_from": self.made_from,
                **shared,
                "updates": int(self.shared.updates),
                "workers": self._states,
                "curve": self.curve,
            },
        )
        with atomic_write(self.folder / CURVE) as part:
            part.write_text(json.dumps(self.curve, indent=1) + "\n")

    def _write(self, name: str, content: dict[str, Any]) -> None:
        with atomic_write(self.folder / name) as part:
            torch.save(content, part)

    def _resume(self) -> None:
        path = self.folder / LAST
        kept = read_checkpoint(path, self.made_from)
        try:
            self.shared.weights.copy_(kept["weights"])
            self.shared.moments.copy_(kept["moments"])
            self.shared.updates.fill_(kept["updates"])
            self._weights.copy_(kept["weights"])
            self._states, self.curve = kept["workers"], kept["curve"]
        except (KeyError, RuntimeError) as error:
            raise _damaged(path) from error
        log(f"{path}: going on after {self.steps} steps")


def save_network(network: ActorCritic, made_from: str) -> dict[str, Any]:
    """The content of a checkpoint that holds a network alone."""
    weights = {name: value.clone() for name, value in network.state_dict().items()}
    shape = dataclasses.asdict(network.shape)
    return {"made_from": made_from, "shape": shape, "network": weights}


def load_network(network: ActorCritic, path: Path, made_from: str) -> None:
    """Give a network the weights of a checkpoint.

    Raises
    ------
    UserError
        Where it is missing, damaged, or of another row or recipe.
    """
    kept = read_checkpoint(path, made_from)
    try:
        if kept["shape"] != dataclasses.asdict(network.shape):
            raise UserError(
                f"{path}: features or sizes are {kept['shape']}, and the config's are "
                f"{dataclasses.asdict(network.shape)}; delete {path.parent} to train again"
            )
        network.load_state_dict(kept["network"])
    except (KeyError, RuntimeError, TypeError) as error:
        raise _damaged(path) from error


def read_checkpoint(path: Path, made_from: str) -> dict[str, Any]:
    """A checkpoint's content; raises `UserError` where it is damaged or of another training."""
    try:
        kept: dict[str, Any] = torch.load(path, weights_only=True)
        found = kept["made_from"]
    except Exception as error:
        raise _damaged(path) from error
    if found != made_from:
        raise UserError(
            f"{path}: the checkpoint is of another row or recipe ({str(found)[:8]}, not "
            f"{made_from[:8]}); delete {path.parent} to train again"
        )
    return kept


def _damaged(path: Path) -> UserError:
    return UserError(f"{path}: damaged; delete {path.parent} to train again")


def _mean(figures: list[dict[str, float]]) -> dict[str, float]:
    names = dict.fromkeys(name for own in figures for name in own)
    found = {}
    for name in names:
        values = [own[name] for own in figures if name in own]
        found[name] = sum(values) / len(values)
    return found
