"""Pools of workers: one in this process, or several in processes of their own."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Protocol

import torch

from avn.core.errors import UserError
from avn.core.files import writing
from avn.core.numerics import restrict_if_portable
from avn.core.processes import no_processes
from avn.core.progress import log
from avn.core.signals import leave_to_parent
from avn.rl.shared import SharedState
from avn.rl.worker import TrainingSpec, Worker

Report = tuple[dict[str, float], dict[str, Any]]
# Seconds between two updates of the progress.
_LOOK = 0.2
# Files of the workers: what each is to do, and the state that they share.
_TASK, _SHARED = "task.pt", "shared.bin"


class WorkerPool(Protocol):
    """Protocol of pools of workers."""

    def run_chunk(self, updates: int, progress: Callable[[], None]) -> list[Report]:
        """Let every worker make a number of updates.

        Parameters
        ----------
        updates : int
            Updates of each worker.
        progress : callable
            Called from time to time.

        Returns
        -------
        list of (dict, dict)
            Metrics and state of each worker.
        """

    def close(self) -> None:
        """End the workers."""


class LocalPool:
    """Pool of one worker, in this process and with one thread.

    Parameters
    ----------
    spec : TrainingSpec
        Apartments, protocol, network and algorithm.
    shared : SharedState
        Weights and optimiser state.
    states : list of dict
        State of the worker, or an empty list to begin.
    """

    def __init__(
        self, spec: TrainingSpec, shared: SharedState, states: list[dict[str, Any]]
    ) -> None:
        self._threads = torch.get_num_threads()
        torch.set_num_threads(1)
        self._worker = Worker(0, spec, shared, nullcontext)
        if states:
            self._worker.load_state_dict(states[0])

    def run_chunk(self, updates: int, progress: Callable[[], None]) -> list[Report]:
        """Let the worker make a number of updates. See `WorkerPool.run_chunk`."""
        return [(self._worker.run_chunk(updates, progress), self._worker.state_dict())]

    def close(self) -> None:
        """Restore the number of threads."""
        torch.set_num_threads(self._threads)


class SpawnedPool:
    """Pool of workers in processes of their own, with one thread each.

    The workers map the apartments and the shared state from files, which are deleted as soon as all
    have done so.

    Parameters
    ----------
    spec : TrainingSpec
        Apartments, protocol, network and algorithm.
    shared : SharedState
        Weights and optimiser state of all workers; moved to a file.
    states : list of dict
        State of each worker, or an empty list to begin.
    folder : Path
        Folder of the files while the workers start.

    Raises
    ------
    UserError
        Here and in `run_chunk`, if a worker dies; the others are ended.
    """

    def __init__(
        self,
        spec: TrainingSpec,
        shared: SharedState,
        states: list[dict[str, Any]],
        folder: Path,
    ) -> None:
        self._links: list[Connection] = []
        self._processes: list[Any] = []
        try:
            with writing(folder), tempfile.TemporaryDirectory(prefix=".", dir=folder) as files:
                with (Path(files) / _TASK).open("wb") as file:
                    torch.save((spec, states), file)
                shared.move_to(Path(files) / _SHARED)
                self._start(spec.recipe.workers, spec.recipe.update_order, Path(files), shared)
        except BaseException:
            self.close()
            raise

    def _start(self, count: int, order: str, files: Path, shared: SharedState) -> None:
        context = multiprocessing.get_context("spawn")
        try:
            # kept, since an unreferenced semaphore is gone before its process opens it
            self._locks = locks = _locks(context, order, count)
        except OSError as error:
            raise no_processes("algorithm.workers", error) from error
        for rank in range(count):
            ours, theirs = context.Pipe()
            lock = (locks[rank], locks[(rank + 1) % count])
            process = context.Process(
                target=_work, args=(rank, files, len(shared.weights), lock, theirs), daemon=True
            )
            process.start()
            theirs.close()
            self._links.append(ours)
            self._processes.append(process)
        for rank in range(count):  # wait, so that all workers begin with the same weights
            self._report(rank)

    def run_chunk(self, updates: int, progress: Callable[[], None]) -> list[Report]:
        """Let every worker make a number of updates. See `WorkerPool.run_chunk`."""
        for link in self._links:
            with suppress(OSError):  # of a dead worker, which `_report` raises
                link.send(updates)
        reports: dict[int, Report] = {}
        while len(reports) < len(self._links):
            progress()
            open_links = [link for i, link in enumerate(self._links) if i not in reports]
            for ready in wait([*open_links], timeout=_LOOK):
                rank = next(i for i, link in enumerate(self._links) if link is ready)
                reports[rank] = self._report(rank)
        progress()
        return [reports[rank] for rank in range(len(self._links))]

    def _report(self, rank: int) -> Any:
        try:
            kind, found = pickle.loads(self._links[rank].recv_bytes())
        except (EOFError, ConnectionError):
            self._processes[rank].join(5)
            code = self._processes[rank].exitcode
            kind, found = "died", f"its process ended with code {code}"
        if kind == "done":
            return found
        self.close()
        if kind == "refused":
            raise UserError(found)
        raise UserError(
            f"algorithm.workers: worker {rank} died: {found}; the last checkpoint is whole, the "
            "same command goes on from it"
        )

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.join()


def _locks(context: Any, order: str, count: int) -> list[Any]:
    """Return the semaphore that each rank acquires; it releases that of the next rank."""
    if order == "free":
        return [context.Semaphore(1)] * count
    return [context.Semaphore(int(rank == 0)) for rank in range(count)]


@contextmanager
def _lock(own: Any, following: Any) -> Iterator[None]:
    own.acquire()
    yield
    following.release()


def _work(
    rank: int,
    files: Path,
    parameters: int,
    locks: tuple[Any, Any],
    link: Connection,
) -> None:
    """Run rounds in a process until it is ended."""
    leave_to_parent()
    restrict_if_portable()
    torch.set_num_threads(1)

    def lock() -> AbstractContextManager[None]:
        return _lock(*locks)

    def send(kind: str, content: Any) -> None:
        # as bytes: a connection would send tensors through shared memory
        link.send_bytes(pickle.dumps((kind, content)))

    try:
        # written by the parent, so it may hold any class
        spec, states = torch.load(files / _TASK, mmap=True, weights_only=False)
        worker = Worker(rank, spec, SharedState.mapped(files / _SHARED, parameters), lock)
        if states:
            worker.load_state_dict(states[rank])
        send("done", None)
        while True:
            metrics = worker.run_chunk(link.recv())
            send("done", (metrics, worker.state_dict()))
    except (EOFError, KeyboardInterrupt):
        return
    except UserError as error:
        answer = ("refused", str(error))
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{os.path.basename(last.filename)}:{last.lineno}"
        answer = ("died", f"{type(error).__name__}: {error} ({where})")
    with suppress(OSError):  # if the parent has ended
        send(*answer)


def start_pool(
    spec: TrainingSpec, shared: SharedState, states: list[dict[str, Any]], folder: Path
) -> WorkerPool:
    """Start the workers of a training.

    Parameters
    ----------
    spec : TrainingSpec
        Apartments, protocol, network and algorithm.
    shared : SharedState
        Weights and optimiser state of all workers.
    states : list of dict
        State of each worker, or an empty list to begin.
    folder : Path
        Folder of the training, in which several workers have temporary files.

    Returns
    -------
    WorkerPool
    """
    cores, workers = os.cpu_count() or 1, spec.recipe.workers
    if workers > cores:
        log(
            f"algorithm.workers: {workers} workers share {cores} cores and will wait for one "
            "another"
        )
    if workers == 1:
        return LocalPool(spec, shared, states)
    return SpawnedPool(spec, shared, states, folder)
