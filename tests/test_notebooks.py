"""The notebooks of `examples/` run from their first cell to their last, as a user runs them."""

import os
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

EXAMPLES = Path(__file__).parents[1] / "examples"
NOTEBOOKS = sorted(path.name for path in EXAMPLES.glob("*.ipynb"))
# What each shows: a part of the text that its cells print.
SHOWN = {
    "1_first_steps.ipynb": ("cells, sources in the cells", "image/png", "spl"),
    "2_your_own_sound_network.ipynb": ("error_m/", "spl"),
    "3_your_own_agent.ipynb": ("succeeded within ten actions", "spl"),
    "4_your_own_apartment.ipynb": ("home.json: sources[0]", "home: ", "spl"),
    "5_reading_a_run.ipynb": ("image/png", "difference"),
}


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_and_shows_what_it_is_for(name, tmp_path, outputs, monkeypatch):
    (tmp_path / "outputs").symlink_to(outputs)  # what other tests have made is not made again
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(EXAMPLES.parent / "src")]))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    notebook = nbformat.read(EXAMPLES / name, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "outputs do not belong here"
    NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    ).execute()
    found = str([cell.get("outputs", []) for cell in notebook.cells])
    for text in SHOWN[name]:
        assert text in found
    assert "Warning" not in found


def test_every_notebook_has_an_expectation():
    assert set(NOTEBOOKS) == set(SHOWN)
