"""A finished run is answered from its record, unless anything that it depends on has changed."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile

from avn.config import answers

HEAVY = "{'torch', 'lightning', 'numba', 'scipy', 'matplotlib', 'h5py'}"


def in_a_new_process(outputs, *arguments):
    code = (
        "import sys\nfrom avn.eval import main\n"
        f"code = main(); print(code, sorted({HEAVY} & sys.modules.keys()))"
    )
    given = ("agent=random_walk", "split=mini", "protocol.num_starts=4", f"outputs={outputs}")
    done = subprocess.run(
        [sys.executable, "-c", code, *given, *arguments], capture_output=True, text=True, check=True
    )
    *shown, folder, last = done.stdout.strip().splitlines()
    return shown, folder, last


def test_a_finished_run_is_shown_without_large_packages(outputs):
    first = in_a_new_process(outputs, "seed=7")
    again = in_a_new_process(outputs, "seed=7")
    assert again[2] == "0 []"
    assert again[1] == first[1]
    assert again[0] == first[0][-len(again[0]) :]  # without the lines about what was made


@pytest.fixture
def recalled(command, outputs, monkeypatch):
    """Run the command; return its folder, and whether it was answered from a record."""
    found = []
    real = answers.recall

    def watched(*arguments):
        found.append(real(*arguments))
        return found[-1]

    monkeypatch.setattr(answers, "recall", watched)

    def run(*arguments):
        given = ("agent=random_walk", "split=mini", "protocol.num_starts=4", f"outputs={outputs}")
        code, out, err = command("eval", *given, *arguments)
        assert code == 0, err
        return Path(out[-1]), bool(found and found.pop() is not None)

    return run


def test_another_recording_under_the_same_path_is_another_answer(recalled, tmp_path):
    path = tmp_path / "tone.wav"
    times = np.arange(16000) / 16000
    soundfile.write(path, 0.1 * np.sin(2 * np.pi * 500 * times), 16000)
    before, _ = recalled(f"sound={path}")
    assert recalled(f"sound={path}") == (before, True)
    soundfile.write(path, 0.1 * np.sin(2 * np.pi * 900 * times), 16000)
    after, known = recalled(f"sound={path}")
    assert after != before
    assert not known


def test_a_run_that_was_deleted_or_forced_is_made(recalled):
    folder, _ = recalled("seed=8")
    assert recalled("seed=8") == (folder, True)
    made = (folder / "results.csv").stat().st_mtime_ns
    assert recalled("seed=8", "force=true") == (folder, False)
    assert (folder / "results.csv").stat().st_mtime_ns > made
    (folder / "results.csv").unlink()
    assert recalled("seed=8") == (folder, False)
    assert (folder / "results.csv").is_file()


def test_a_setting_that_is_not_read_is_refused_after_an_answer_too(recalled, command, outputs):
    recalled("seed=9")
    given = ("agent=random_walk", "split=mini", "protocol.num_starts=4", f"outputs={outputs}")
    code, _, err = command("eval", *given, "seed=9", "acoustics.rays=77")
    assert code == 2
    assert "acoustics.rays: not read" in err[-1]


def test_a_file_of_the_package_or_of_a_named_folder_changes_the_record(tmp_path, monkeypatch):
    (tmp_path / "plans").mkdir()
    plan = tmp_path / "plans" / "a.json"
    plan.write_text("{}")
    settings = {"split": {"folder": str(tmp_path / "plans")}, "other": str(tmp_path)}
    before = answers._named(settings)
    assert len(before) == 1
    os.utime(plan, ns=(1, 1))
    assert answers._named(settings) != before
    files = answers._files(tmp_path)
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "a.pyc").write_text("")
    assert answers._files(tmp_path) == files
    (tmp_path / "new.py").write_text("")
    assert answers._files(tmp_path) != files
