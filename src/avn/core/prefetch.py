"""Work that runs ahead: batches are made in threads while the network learns from earlier ones.

One thread for an operation and several operations side by side: the operations on a batch of
clips are too short to be divided among threads, which on a busy machine wait for one another
ten times longer than they work.
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
    """Give `make(part)` for each part in order, made in `threads` threads.

    Not more than two results a thread wait in memory. What the parts are is asked for in the
    calling thread.
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
    """A data loader whose dataset makes whole batches, ahead, in threads of this process.

    Threads share the impulse responses that lie in memory; processes would each load them.

    Parameters
    ----------
    dataset : Dataset
        Its `__getitems__` gives a batch, and may be called by several threads at once.
    threads : int
    **options
        Those of `torch.utils.data.DataLoader`.
    """

    def __init__(self, dataset: Any, threads: int, **options: Any) -> None:
        super().__init__(dataset, **options)
        self.threads = threads

    def __iter__(self) -> Iterator[Any]:  # type: ignore[override]
        return prefetch(self.dataset.__getitems__, self.batch_sampler, self.threads)  # type: ignore
