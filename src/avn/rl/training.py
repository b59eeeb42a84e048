"""Training of an actor-critic in rounds, with validation and a checkpoint after each."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.core.progress import log, progress_bar
from avn.rl.networks import ActorCritic
from avn.rl.shared import SharedState, flatten_parameters
from avn.rl.worker import TrainingSpec
from avn.rl.worker_pool import start_pool

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter

LAST, BEST, CURVE = "last.ckpt", "best.ckpt", "curve.json"
# Validation metric that selects the best network.
MONITOR = "validation/spl"
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
        Returns the validation metrics of a network by name, including `MONITOR`.
    fingerprint : str
        Hash of all settings and data of the training, stored in checkpoints.
    run_name : str
        Folder of the TensorBoard events below `folder`, which names the run in TensorBoard.

    Attributes
    ----------
    curve : list of dict
        Metrics of each round by name; the first entry is the untrained network.

    Raises
    ------
    UserError
        If the last checkpoint is damaged or belongs to another training.
    """

    def __init__(
        self,
        spec: TrainingSpec,
        network: ActorCritic,
        folder: Path,
        measure: Measure,
        fingerprint: str,
        run_name: str = "",
    ) -> None:
        self.run_name = run_name
        self.spec, self.network, self.folder = spec, network, folder
        self.measure, self.fingerprint = measure, fingerprint
        self._weights, _ = flatten_parameters(network)
        self.shared = SharedState.of(self._weights)
        self.curve: list[dict[str, float]] = []
        self._states: list[dict[str, Any]] = []
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / LAST).is_file():
            self._resume()

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
            If a worker dies.
        """
        from torch.utils.tensorboard import SummaryWriter

        recipe = self.spec.recipe
        updates = max(1, recipe.total_steps // (recipe.batch * recipe.workers))
        planned = max(1, round(recipe.total_steps / recipe.validate_every))
        each = -(-updates // min(planned, updates))
        last = -(-updates // each)
        if rounds is not None:
            last = min(last, len(self._rounds()) + rounds)
        bar = progress_bar(
            f"training of {self.folder.name}", updates * recipe.workers, "batches", self._batches
        )
        events = SummaryWriter(str(self.folder / self.run_name), purge_step=self.steps + 1)
        with events as writer, bar as advance:
            if not self.curve:
                self._end_round({}, writer)
            if len(self._rounds()) < last:
                self._go(last, each, updates, writer, advance)
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
        writer: SummaryWriter,
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
                self._end_round(metrics, writer)
        finally:
            pool.close()

    def _end_round(self, metrics: dict[str, float], writer: SummaryWriter) -> None:
        """Validate, save the best network, log, and write the checkpoint."""
        self._weights.copy_(self.shared.weights)
        found = {"steps": float(self.steps), **metrics, **self.measure(self.network)}
        self.curve.append(found)
        if best_of(self.curve) is found:
            self._write(BEST, save_network(self.network, self.fingerprint))
        for name, value in found.items():
            if name != "steps":
                group = name if "/" in name else f"steps/{name}"
                writer.add_scalar(group, value, self.steps)
        writer.flush()
        shared = {key: getattr(self.shared, key).clone() for key in ("weights", "moments")}
        self._write(
            LAST,
            {
                "fingerprint": self.fingerprint,
                **shared,
                "updates": int(self.shared.updates),
                "workers": self._states,
                "curve": self.curve,
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
        except (KeyError, RuntimeError) as error:
            raise _damaged(path) from error
        log(f"{path}: going on after {self.steps} steps")


def best_of(curve: Sequence[dict[str, float]]) -> dict[str, float]:
    """Return the entry of a curve whose network is kept.

    It is the best on validation of the networks that were trained, the latest of equal ones. The
    untrained network, the first entry, is the best only while it is alone: small validation
    apartments may rate it higher by chance.
    """
    return max(reversed(curve[1:] or curve), key=lambda point: point[MONITOR])


def save_network(network: ActorCritic, fingerprint: str) -> dict[str, Any]:
    """Return the content of a checkpoint of a network alone."""
    weights = {name: value.clone() for name, value in network.state_dict().items()}
    network_spec = dataclasses.asdict(network.spec)
    return {"fingerprint": fingerprint, "network_spec": network_spec, "network": weights}


def load_network(network: ActorCritic, path: Path, fingerprint: str) -> None:
    """Load the weights of a checkpoint into a network.

    Parameters
    ----------
    network : ActorCritic
        Changed in place.
    path : Path
        Checkpoint of `save_network`.
    fingerprint : str
        Expected fingerprint of the checkpoint.

    Raises
    ------
    UserError
        If the checkpoint is missing, damaged or of another training.
    """
    kept = read_checkpoint(path, fingerprint)
    try:
        if kept["network_spec"] != dataclasses.asdict(network.spec):
            raise UserError(
                f"{path}: features or sizes are {kept['network_spec']}, and the config's are "
                f"{dataclasses.asdict(network.spec)}; delete {path.parent} to train again"
            )
        network.load_state_dict(kept["network"])
    except (KeyError, RuntimeError, TypeError) as error:
        raise _damaged(path) from error


def read_checkpoint(path: Path, fingerprint: str) -> dict[str, Any]:
    """Read the content of a checkpoint.

    Raises
    ------
    UserError
        If it is missing, damaged or of another training.
    """
    try:
        kept: dict[str, Any] = torch.load(path, weights_only=True)
        found = kept["fingerprint"]
    except Exception as error:
        raise _damaged(path) from error
    if found != fingerprint:
        raise UserError(
            f"{path}: the checkpoint is of another row or recipe ({str(found)[:8]}, not "
            f"{fingerprint[:8]}); delete {path.parent} to train again"
        )
    return kept


def _damaged(path: Path) -> UserError:
    return UserError(f"{path}: damaged; delete {path.parent} to train again")


def _mean(metrics: list[dict[str, float]]) -> dict[str, float]:
    names = dict.fromkeys(name for own in metrics for name in own)
    found = {}
    for name in names:
        values = [own[name] for own in metrics if name in own]
        found[name] = sum(values) / len(values)
    return found
