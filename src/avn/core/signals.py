"""Orderly end of a command that a signal stops, or whose output nobody reads any more."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

# Signals that stop a command: of Ctrl-C, of Slurm and containers, of a terminal that is closed.
STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stopped(BaseException):
    """A signal stops the command.

    No `Exception` and no `KeyboardInterrupt`, so that neither a sweep takes it for a failed job nor
    Lightning for an interruption that it handles itself.
    """


def exit_code_of(name: str, task: Callable[[], int]) -> int:
    """Run a command to its end or until a signal stops it.

    A second signal ends the process at once. Signals that the caller ignores, such as SIGHUP of
    `nohup`, stay ignored.

    Parameters
    ----------
    name : str
        Name of the command, for the message.
    task : callable
        The command; returns its exit code.

    Returns
    -------
    int
        Exit code of the command, or 128 + the number of the signal: 130 for SIGINT, 143 for
        SIGTERM, 129 for SIGHUP, and 141 where the reader of the output has gone.
    """
    with _handled() as received:
        try:
            try:
                code = task()
                with suppress(OSError, ValueError):  # so that the exit of Python writes nothing
                    sys.stdout.flush()
            finally:
                # the handler of SIGPIPE runs after the error of the write, at the next call
                _nothing()
        except BaseException:
            if not received:
                raise
        if not received:
            return code
        if received[0] == signal.SIGPIPE:
            _write_nowhere()
        else:
            with suppress(OSError):  # of a terminal that is closed
                print(_line(name, received[0]), file=sys.stderr, flush=True)
        return 128 + received[0]


def _nothing() -> None:
    """Give the handlers of signals that have come an occasion to run."""


def _line(name: str, number: int) -> str:
    return (
        f"{name}: stopped by {signal.Signals(number).name}; what is finished is kept, and the same "
        "command goes on from there"
    )


@contextmanager
def _handled() -> Iterator[list[int]]:
    """Let signals raise `Stopped`; yields the list of the received ones."""
    received: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:
        if number == signal.SIGPIPE and not _reader_gone():
            return  # of a worker or a socket, whose writer gets a `BrokenPipeError`
        if received:
            if number == signal.SIGPIPE:
                return
            os._exit(128 + received[0])
        received.append(number)
        raise Stopped

    def report(error: threading.ExceptHookArgs) -> None:
        if not isinstance(error.exc_value, OSError):  # which TensorBoard raises at its end too
            threading.__excepthook__(error)

    before, hook = {}, threading.excepthook
    threading.excepthook = report
    if threading.current_thread() is threading.main_thread():
        for number in (*STOPPING, signal.SIGPIPE):
            # Python itself ignores SIGPIPE
            if number == signal.SIGPIPE or signal.getsignal(number) != signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
    try:
        yield received
    finally:
        threading.excepthook = hook
        for number, handler in before.items():
            signal.signal(number, handler)


def _reader_gone() -> bool:
    """Return whether standard output or the error stream is a pipe that nobody reads."""
    poll = select.poll()
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):  # of a stream that is no file
            poll.register(stream.fileno(), 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


def _write_nowhere() -> None:
    """Send what Python still has to write to nowhere, so that its exit is quiet."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):
            os.dup2(nowhere, stream.fileno())


def leave_to_parent() -> None:
    """Let the parent alone end this worker process, and end it when the parent has died.

    The signals of a terminal or a batch system reach every process of a command.
    """
    for number in STOPPING:
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
