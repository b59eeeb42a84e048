"""The notebooks of `examples/` run from their first cell to their last, in a small world."""

import asyncio
import gc
import os
from pathlib import Path

import nbformat
import pytest
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from omegaconf import OmegaConf
from small import SMALL

from avn.config.folder import conf_folder

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
OPTIONS = {"acoustics": "resonance", "renderer": "raycast", "sound_model": "cnn5"}
WORLD = "WORLD = ["


@pytest.fixture(scope="module")
def small_options(tmp_path_factory):
    """A config folder in which the package's own options are those of small worlds."""
    folder = tmp_path_factory.mktemp("small")
    for group, option in OPTIONS.items():
        own = [given.removeprefix(f"{group}.") for given in SMALL if given.startswith(f"{group}.")]
        path = Path(group, f"{option}.yaml")
        changed = OmegaConf.merge(OmegaConf.load(conf_folder() / path), OmegaConf.from_dotlist(own))
        (folder / group).mkdir()
        OmegaConf.save(changed, folder / path)
    return folder


@pytest.fixture(scope="module")
def kernel():
    """One kernel for all notebooks, for it imports large packages."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join([str(EXAMPLES.parent / "src")]))
        patch.setenv("OMP_NUM_THREADS", "1")
        manager = AsyncKernelManager(kernel_name="python3")
        yield manager
        asyncio.run(manager.shutdown_kernel(now=True))


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_and_shows_what_it_is_for(name, tmp_path, outputs, kernel, small_options):
    (tmp_path / "outputs").symlink_to(outputs)  # what other tests have made is not made again
    notebook = nbformat.read(EXAMPLES / name, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "outputs do not belong here"
    assert sum(cell.source.count(WORLD) for cell in notebook.cells) == 1
    for cell in notebook.cells:
        cell.source = cell.source.replace(WORLD, f'{WORLD}"--config-dir={small_options}", ')
    begin = f"%reset -f\nimport os\nos.chdir({str(tmp_path)!r})\ndel os"
    notebook.cells.insert(0, nbformat.v4.new_code_cell(begin))
    NotebookClient(notebook, timeout=600, km=kernel).execute()
    # collected later, the client of the kernel may write a warning into the output of another test
    gc.collect()
    found = str([cell.get("outputs", []) for cell in notebook.cells])
    for text in SHOWN[name]:
        assert text in found
    assert "Warning" not in found


def test_every_notebook_has_an_expectation():
    assert set(NOTEBOOKS) == set(SHOWN)
