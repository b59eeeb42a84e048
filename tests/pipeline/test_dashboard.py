import io

import pytest
from rich.console import Console

from avn.core.progress import progress_bar
from avn.pipeline import dashboard
from avn.pipeline.dashboard import Dashboard

STAGES = [(f"stage {n}", 100.0) for n in range(20)]


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 0.0

        def monotonic(self):
            return self.now

    own = Clock()
    monkeypatch.setattr(dashboard, "time", own)
    return own


def board(terminal=True, height=24):
    console = Console(file=io.StringIO(), force_terminal=terminal, width=100, height=height)
    return Dashboard(STAGES, ["greedy", "ours"], {"ours": "58.7 / 39.1"}, console), console


def text(shown):
    console = Console(file=io.StringIO(), width=100)
    console.print(shown.render())
    return console.file.getvalue()


def test_the_time_left_is_what_was_planned_at_the_pace_so_far(clock):
    shown, _ = board()
    assert shown.time_left() == pytest.approx(2000.0)
    clock.now = 30.0
    assert shown.time_left() == pytest.approx(1970.0)
    clock.now = 200.0
    assert shown.time_left() == pytest.approx(1900.0)  # late, and still to be made
    shown.made()  # twice as slow as planned
    assert shown.time_left() == pytest.approx(2 * 1900.0)
    clock.now = 300.0
    assert shown.time_left() == pytest.approx(2 * 1900.0 - 100.0)
    for _ in STAGES[1:]:
        shown.made()
    assert shown.time_left() == 0.0


def test_stages_and_rows_fill_as_they_are_made(clock):
    shown, _ = board()
    assert "stage 0" in text(shown)
    assert "stage 19" not in text(shown)
    for _ in range(10):
        clock.now += 90.0
        shown.made()
    shown.fill("ours", "83.3 / 73.1")
    lines = text(shown).splitlines()
    assert lines[0].startswith("15.0 min passed, about 15.0 min left")
    assert any(line.split() == ["ours", "83.3", "/", "73.1", "58.7", "/", "39.1"] for line in lines)
    assert any(line.split() == ["greedy", "-", "-"] for line in lines)
    assert any(line.split() == ["6", "stages", "9.0", "min"] for line in lines)
    assert any(line.split() == ["stage", "10", "1.7", "min", "0", "s", "..."] for line in lines)
    assert not any("more stages" in line for line in lines)


@pytest.mark.parametrize("height", [24, 40])
def test_it_fits_the_terminal(height):
    stages = [("what is made " * 20, 100.0)] * 40
    console = Console(file=io.StringIO(), force_terminal=True, width=80, height=height)
    shown = Dashboard(stages, [f"row_{n}" for n in range(10)], {}, console)
    for _ in range(20):
        shown.made()
    with shown, progress_bar("listening", 10, "clips"):
        assert len(console.render_lines(shown.render())) <= height


def test_bars_stand_in_the_dashboard_as_long_as_their_work_lasts():
    shown, console = board()
    with shown, progress_bar("listening in room_1", 10, "clips") as done:
        done(4)
        assert "listening in room_1" in text(shown)
        assert "4/10" in text(shown)
    assert "listening in room_1" not in text(shown)
    assert "stage 0" in console.file.getvalue()


def test_nothing_is_drawn_into_a_file():
    shown, console = board(terminal=False)
    with shown:
        shown.made()
    assert console.file.getvalue() == ""
