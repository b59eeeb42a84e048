"""Lines about work in progress, where the output is no terminal."""

import time

import pytest

from avn.core import heartbeat
from avn.core.heartbeat import Work
from avn.core.progress import progress_bar, working


@pytest.fixture(autouse=True)
def _fast(monkeypatch):
    monkeypatch.setattr(heartbeat, "FIRST", 0.05)
    monkeypatch.setattr(heartbeat, "INTERVAL", 0.2)
    monkeypatch.setattr(heartbeat, "_due", 0.0)


def test_lines_come_in_intervals_also_when_the_work_does_not_advance(capsys):
    with progress_bar("tracing sound", 100, "pairs") as advance:
        advance(10)
        time.sleep(0.6)
    lines = capsys.readouterr().err.splitlines()
    assert 2 <= len(lines) <= 4
    assert all(line.startswith("tracing sound: 10 of 100 pairs") for line in lines)
    assert all("pairs/s" in line and line.endswith(" left") for line in lines)
    time.sleep(0.3)
    assert not capsys.readouterr().err


def test_short_work_after_short_work_does_not_add_lines(capsys):
    for _ in range(20):
        with progress_bar("features", 10, "views") as advance:
            advance(10)
            time.sleep(0.02)
    assert len(capsys.readouterr().err.splitlines()) <= 3


def test_the_innermost_work_is_reported(capsys):
    with working("sound network"):
        time.sleep(0.1)
        with progress_bar("training", 10, "clips"):
            time.sleep(0.25)
    first, *others = capsys.readouterr().err.splitlines()
    assert first.startswith("sound network: ")
    assert first.endswith("so far")
    assert others
    assert all(line.startswith("training: 0 of 10 clips") for line in others)


def test_rate_and_time_left_are_of_the_work_that_is_done_now(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(heartbeat.time, "monotonic", lambda: now[0])
    work = Work("rendering", 1000, "views", done=400)
    work.advance(100)
    now[0] += 50
    assert work.line() == "rendering: 500 of 1000 views, 2 views/s, about 4.2 min left"
