"""End of a command by a signal, and end of worker processes with their parent."""

import os
import signal
import subprocess
import sys
import time

import pytest

from avn.core.signals import Stopped, exit_code_of

WORKERS = """
import os, sys, time
from pathlib import Path
from avn.core.processes import in_processes
from avn.core.signals import exit_code_of

def work(path):
    Path(path).write_text(str(os.getpid()))
    time.sleep(60)

if __name__ == "__main__":
    files = [f"{sys.argv[1]}/{number}" for number in range(2)]
    sys.exit(exit_code_of("avn.test", lambda: len(list(in_processes(work, files, 2)))))
"""


def alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # one that has ended, whose parent has not asked
    with open(f"/proc/{process}/stat") as stat:
        return stat.read().rsplit(")", 1)[1].split()[0] != "Z"


def until(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_gives_its_code_and_one_line(number, capsys):
    cleaned = []

    def task():
        try:
            os.kill(os.getpid(), number)
            time.sleep(10)
        finally:
            cleaned.append(True)
        return 0

    handlers = [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)]
    assert exit_code_of("avn.train", task) == 128 + number
    assert cleaned
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"avn.train: stopped by {number.name}")
    assert "kept" in line
    assert "same command" in line
    assert [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)] == handlers


def test_a_signal_is_no_error_that_a_job_of_a_sweep_may_have():
    assert not issubclass(Stopped, Exception | KeyboardInterrupt)

    def sweep():
        for _ in range(3):
            try:
                os.kill(os.getpid(), signal.SIGTERM)
            except Exception:
                pytest.fail("taken for the failure of a job")
        return 0

    assert exit_code_of("avn.eval", sweep) == 143


def test_a_signal_that_the_caller_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as `nohup` does
    try:
        assert exit_code_of("avn.eval", lambda: os.kill(os.getpid(), signal.SIGHUP) or 0) == 0
    finally:
        signal.signal(signal.SIGHUP, before)


def test_errors_and_codes_of_a_command_pass_through():
    assert exit_code_of("avn.eval", lambda: 2) == 2
    with pytest.raises(ZeroDivisionError):
        exit_code_of("avn.eval", lambda: 1 // 0)


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_closed_pipe_is_quiet(stream):
    code = (
        "import sys; from avn.core.signals import exit_code_of\n"
        "def task():\n"
        f"    for _ in range(99): print('x' * 9999, file=sys.{stream}, flush=True)\n"
        "    return 0\n"
        "sys.exit(exit_code_of('avn.eval', task))"
    )
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], **pipes) as process:
        getattr(process, stream).close()
        other = process.stderr if stream == "stdout" else process.stdout
        assert other.read() == b""
    assert process.returncode == 141


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_their_parent(number, tmp_path):
    script = tmp_path / "workers.py"
    script.write_text(WORKERS)
    with subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)], stderr=subprocess.PIPE
    ) as process:
        files = [tmp_path / "0", tmp_path / "1"]
        assert until(lambda: all(file.is_file() and file.read_text() for file in files))
        workers = [int(file.read_text()) for file in files]
        for worker in workers:  # what a terminal or Slurm sends to all is the parent's to handle
            os.kill(worker, signal.SIGINT)
        time.sleep(0.1)
        assert all(map(alive, workers))
        process.send_signal(number)
        assert process.wait(30) == (143 if number == signal.SIGTERM else -9)
    assert until(lambda: not any(map(alive, workers)), 10)
