"""What the tests share: the commands run in this process, and the mini split built once."""

from __future__ import annotations

import importlib
import signal
import sys

import pytest
import torch
from hydra.core.global_hydra import GlobalHydra

torch.set_num_threads(1)  # also for what is made once a session


@pytest.fixture(autouse=True, scope="session")
def signals_of_a_terminal():
    """Signals that `nohup` or a shell's background job ignores end a command, as in a terminal."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(autouse=True)
def one_thread():
    """One thread for each test process, whatever the test before has set."""
    torch.set_num_threads(1)


@pytest.fixture
def command(monkeypatch, capfd):
    """Run `python -m avn.<name> <arguments>` here; gives exit code, output and error lines."""

    def run(name, *arguments):
        GlobalHydra.instance().clear()
        monkeypatch.setattr(sys, "argv", [f"avn.{name}", *arguments])
        monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
        module = importlib.import_module(f"avn.{name}")
        capfd.readouterr()
        try:
            code = module.main()
        except SystemExit as exit_:
            code = exit_.code
        out, err = capfd.readouterr()
        return code, out.splitlines(), err.splitlines()

    return run


@pytest.fixture(scope="session")
def outputs(tmp_path_factory):
    """One folder for what the commands make, so that each stage is made once a session."""
    return tmp_path_factory.mktemp("outputs")
