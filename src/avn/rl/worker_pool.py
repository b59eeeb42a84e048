"""Pools of workers: one in this process, or several in processes of their own."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol

import torch
import torch.multiprocessing as mp

from avn.core.errors import UserError
from avn.core.progress import log
from avn.rl.shared import SharedState
from avn.rl.worker import TrainingSpec, Worker

Report = tuple[dict[str, float], dict[str, Any]]
# Seconds between two updates of the progress.
_LOOK = 0.2


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

    Parameters
    ----------
    spec : TrainingSpec
        Apartments, protocol, network and algorithm.
    shared : SharedState
        Weights and optimiser state of all workers.
    states : list of dict
        State of each worker, or an empty list to begin.

    Raises
    ------
    UserError
        Here and in `run_chunk`, if a worker dies; the others are ended.
    """

    def __init__(
        self, spec: TrainingSpec, shared: SharedState, states: list[dict[str, Any]]
    ) -> None:
        context, count = mp.get_context("spawn"), spec.recipe.workers
        spec.tables.share()
        # kept, since an unreferenced semaphore is gone before its process opens it
        self._locks = locks = _locks(context, spec.recipe.update_order, count)
        self._links: list[Connection] = []
        self._processes = []
        for rank in range(count):
            ours, theirs = context.Pipe()
            lock = (locks[rank], locks[(rank + 1) % count])
            state = states[rank] if states else None
            process = context.Process(
                target=_work, args=(rank, spec, shared, lock, theirs, state), daemon=True
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
            kind, found = self._links[rank].recv()
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
            process.terminate()
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
    spec: TrainingSpec,
    shared: SharedState,
    locks: tuple[Any, Any],
    link: Connection,
    state: dict[str, Any] | None,
) -> None:
    """Run rounds in a process until it is ended."""
    torch.set_num_threads(1)

    def lock() -> AbstractContextManager[None]:
        return _lock(*locks)

    try:
        worker = Worker(rank, spec, shared, lock)
        if state is not None:
            worker.load_state_dict(state)
        link.send(("done", None))
        while True:
            metrics = worker.run_chunk(link.recv())
            link.send(("done", (metrics, worker.state_dict())))
    except (EOFError, KeyboardInterrupt):
        return
    except UserError as error:
        answer = ("refused", str(error))
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{os.path.basename(last.filename)}:{last.lineno}"
        answer = ("died", f"{type(error).__name__}: {error} ({where})")
    with suppress(OSError):  # if the parent has ended
        link.send(answer)


def start_pool(spec: TrainingSpec, shared: SharedState, states: list[dict[str, Any]]) -> WorkerPool:
    """Start the workers of a training.

    Parameters
    ----------
    spec : TrainingSpec
        Apartments, protocol, network and algorithm.
    shared : SharedState
        Weights and optimiser state of all workers.
    states : list of dict
        State of each worker, or an empty list to begin.

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
    return (LocalPool if workers == 1 else SpawnedPool)(spec, shared, states)
