"""Distribution of jobs over worker processes."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from avn.core.errors import UserError
from avn.core.numerics import restrict_if_portable
from avn.core.signals import leave_to_parent

Job = TypeVar("Job")
Result = TypeVar("Result")


def in_processes(
    work: Callable[[Job], Result], jobs: Sequence[Job], processes: int
) -> Iterator[Result]:
    """Run all jobs, started in their order, and yield each result when it is done.

    When the caller stops early, by an exception or a signal, the processes are killed. They also
    end when this process is killed.

    Parameters
    ----------
    work : callable
        Function of a job, at the top level of a module, so that it can be pickled. It may be killed
        at any time, and so writes files under a temporary name first.
    jobs : sequence
        Arguments of `work`.
    processes : int
        Number of processes; with 1, or a single job, the work is done in this process.

    Raises
    ------
    UserError
        If a process dies, or none can be started.
    """
    if processes <= 1 or len(jobs) <= 1:
        yield from map(work, jobs)
        return
    context = multiprocessing.get_context("spawn")  # a forked child would inherit torch's threads
    others = set(multiprocessing.active_children())
    try:
        pool = ProcessPoolExecutor(
            min(processes, len(jobs)), mp_context=context, initializer=_begin
        )
    except OSError as error:
        raise no_processes("processes", error) from error
    with pool:
        futures: list[Future[Result]] = [pool.submit(work, job) for job in jobs]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BrokenProcessPool as error:
            raise UserError(
                "processes: a worker process was killed, perhaps for want of memory; give fewer, "
                "such as processes=1; the same command goes on from what is finished"
            ) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in set(multiprocessing.active_children()) - others:
                process.kill()
            raise


def _begin() -> None:
    leave_to_parent()
    restrict_if_portable()


def no_processes(option: str, error: OSError) -> UserError:
    """Return the error for a machine on which no worker process can be started.

    Their semaphores are in shared memory, which a container may not have.

    Parameters
    ----------
    option : str
        Option of the number of processes.
    error : OSError
        The cause.
    """
    return UserError(
        f"{option}: no worker process can be started ({error.strerror}); give {option}=1, or make "
        "/dev/shm writable"
    )
