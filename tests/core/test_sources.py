"""The hash of the user's own source files: what it must and must not depend on."""

import subprocess
import sys

import pytest

from avn.core.sources import outside_sources, source_files, source_hash


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder on the path with `mine.py`, which imports in every way there is."""
    files = {
        "mine.py": "import json\nimport torch\nimport helper\nfrom pack import thing\n"
        "from pack.deep.inner import f\n\ndef g():\n    import late\n",
        "helper.py": "import avn.core.actions\nimport nowhere\n",
        "late.py": "import mine\n",
        "unused.py": "",
        "pack/__init__.py": "",
        "pack/thing.py": "from . import sibling\n",
        "pack/sibling.py": "from .deep import other\n",
        "pack/deep/__init__.py": "",
        "pack/deep/inner.py": "from .. import above\n",
        "pack/deep/other.py": "",
        "pack/above.py": "",
        "broken.py": "def (",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_files_that_a_module_imports_from_the_users_folders(folder):
    found = source_files("mine")
    assert set(found) == {
        "mine",
        "helper",
        "late",
        "pack",
        "pack.thing",
        "pack.sibling",
        "pack.above",
        "pack.deep",
        "pack.deep.inner",
        "pack.deep.other",
    }
    assert all(path.is_relative_to(folder) for path in found.values())
    assert "mine" not in sys.modules  # nothing is executed
    assert set(source_files("pack.deep.other")) == {"pack", "pack.deep", "pack.deep.other"}
    assert set(source_files("broken")) == {"broken"}


def test_installed_packages_are_left_out_but_for_the_class_s_own():
    assert "yaml.nodes" in source_files("yaml.loader")
    assert not any(name.startswith("yaml") for name in source_files("torch.optim"))
    assert source_files("nowhere.at_all") == {} == source_files("sys")


def test_classes_of_the_package_and_of_torch_have_none(folder):
    node = {
        "_target_": "mine.Agent",
        "net": {"_target_": "avn.modules.five_layer_cnn.FiveLayerCnn"},
        "more": [{"_target_": "torch.optim.Adadelta"}, {"_target_": "helper.Part"}],
        "none": {"_target_": None},
    }
    assert set(outside_sources(node)) == {"mine.Agent", "helper.Part"}


@pytest.mark.parametrize(
    ("file", "changes"),
    [("mine.py", True), ("pack/deep/other.py", True), ("late.py", True), ("unused.py", False)],
)
def test_the_hash_follows_every_file_that_is_imported_and_no_other(folder, file, changes):
    code = "from avn.core.sources import source_hash; print(source_hash('mine.Agent'))"

    def in_a_new_process():
        return subprocess.check_output([sys.executable, "-c", code], cwd=folder, text=True)

    before = in_a_new_process()
    assert before == in_a_new_process()
    with (folder / file).open("a") as text:
        text.write("LATER = 1\n")
    assert (in_a_new_process() != before) == changes


def test_weights_that_a_setting_names_belong_to_the_class(folder, monkeypatch):
    monkeypatch.chdir(folder)
    (folder / "weights.pt").write_bytes(b"first")
    mine = {"_target_": "mine.Agent", "weights": "weights.pt", "more": {"list": ["weights.pt"]}}
    ours = {"_target_": "avn.agents.greedy.Greedy", "weights": "weights.pt"}
    first = outside_sources(mine)
    assert set(first) == {"mine.Agent", "weights.pt"}
    assert outside_sources(ours) == {}
    (folder / "weights.pt").write_bytes(b"later")
    assert outside_sources(mine)["weights.pt"] != first["weights.pt"]


def test_a_policy_counts_as_a_class(folder):
    assert set(
        outside_sources({"_target_": "avn.agents.external.External", "policy": "mine:g"})
    ) == {"mine:g"}


def test_a_class_keeps_its_hash_until_it_is_reloaded(folder):
    import importlib

    (folder / "alone.py").write_text("class One:\n    pass\n")
    importlib.invalidate_caches()
    module = importlib.import_module("alone")
    first = source_hash("alone.One")
    (folder / "alone.py").write_text("class One:\n    size = 1\n")
    assert source_hash("alone.One") == first
    importlib.reload(module)
    assert source_hash("alone.One") != first
