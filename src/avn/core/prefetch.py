"""Prefetching of batches in threads while the network is trained on earlier ones.

Each operation runs on one thread, and several batches are made in parallel: the operations on a
batch of clips are too short to be divided among threads, whose synchronisation on a busy machine
takes ten times as long as the work.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

import torch
from torch.utils.data import DataLoader

Part = TypeVar("Part")
Made = TypeVar("Made")


@contextmanager
def threads_for_one_operation(count: int) -> Iterator[None]:
    """Divide operations of this thread among `count` threads, inside the block only."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def prefetch(make: Callable[[Part], Made], parts: Iterable[Part], threads: int) -> Iterator[Made]:
    """Yield `make(part)` for each part in order, computed in threads.

    At most two results for each thread are kept in memory. The iterable is advanced in the
    calling thread.

    Parameters
    ----------
    make : callable
        Function of a part; must be thread-safe.
    parts : iterable
        Its arguments.
    threads : int
        Number of threads.
    """
    with ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,)) as pool:
        waiting: deque[Future[Made]] = deque()
        try:
            for part in parts:
                waiting.append(pool.submit(make, part))
                if len(waiting) > 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


class PrefetchLoader(DataLoader[Any]):
    """Data loader that prefetches whole batches of a dataset in threads of this process.

    Threads share the impulse responses in memory; processes would each load them.

    Parameters
    ----------
    dataset : Dataset
        Its `__getitems__` returns a batch and must be thread-safe.
    threads : int
        Number of threads.
    **options
        Options of `torch.utils.data.DataLoader`.
    """

    def __init__(self, dataset: Any, threads: int, **options: Any) -> None:
        super().__init__(dataset, **options)
        self.threads = threads

    def __iter__(self) -> Iterator[Any]:  # type: ignore[override]
        """Yield the batches of one epoch."""
        return prefetch(self.dataset.__getitems__, self.batch_sampler, self.threads)  # type: ignore
