"""Worker processes that cannot be started, or die."""

import multiprocessing
import os
import signal

import pytest

from avn.core import processes
from avn.core.errors import UserError
from avn.core.processes import in_processes


def die(number):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_worker_that_is_killed_is_one_line():
    with pytest.raises(UserError, match="processes: a worker process was killed"):
        list(in_processes(die, [0, 1], 2))


def test_a_machine_without_semaphores_is_one_line(monkeypatch):
    def refuse(*_, **__):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(processes, "ProcessPoolExecutor", refuse)
    with pytest.raises(UserError, match="give processes=1"):
        list(in_processes(abs, [0, 1], 2))
    assert not multiprocessing.active_children()
