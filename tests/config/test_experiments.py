"""Experiments: a runnable config file for each table of the documents."""

import re
from pathlib import Path

import pytest
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser

from avn.config.folder import conf_folder

FILES = sorted((conf_folder() / "experiment").glob("*.yaml"))
PAGES = ("reproduction.md", "earlier_results.md", "table.md")
DOCUMENTS = [Path(__file__).parents[2] / "docs" / name for name in PAGES]
COMMAND = re.compile(r"# python -m avn\.(\w+) experiment=(\w+)\n")


def swept(path):
    """Values of each parameter that an experiment sweeps over."""
    content = yaml.safe_load(path.read_text())
    given = content.get("hydra", {}).get("sweeper", {}).get("params", {})
    parser = OverridesParser.create()
    found = {}
    for key, values in given.items():
        override = parser.parse_override(f"{key}={values}")
        sweep = override.is_sweep_override()
        found[key] = list(override.sweep_string_iterator()) if sweep else [str(values)]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_its_command_stands_in_it_and_in_the_documents(path):
    command, name = COMMAND.search(path.read_text()).groups()
    assert name == path.stem
    line = f"python -m avn.{command} experiment={name}"
    assert any(line in document.read_text() for document in DOCUMENTS)


# the first and the last job of each experiment, which are one where it sweeps over nothing
JOBS = {
    f"{path.stem}-{place}": (path, which)
    for path in FILES
    for place, which in (("first", 0), ("last", -1))
    if not which or any(len(values) > 1 for values in swept(path).values())
}


@pytest.mark.parametrize(("path", "which"), JOBS.values(), ids=JOBS)
def test_its_jobs_lack_products_alone(command, tmp_path, path, which):
    name, _ = COMMAND.search(path.read_text()).groups()
    chosen = [f"{key}={values[which]}" for key, values in swept(path).items()]
    if which and (seeds := yaml.safe_load(path.read_text()).get("seeds")):
        chosen.append(f"seeds={seeds[-1]}")  # the first job has all of them
    given = ("split=mini", "auto=false", f"outputs={tmp_path}/o")
    code, _, err = command(name, f"experiment={path.stem}", *chosen, *given)
    assert code == 2
    assert "is missing and auto=false" in err[0]


def test_jobs_are_all_combinations(command, tmp_path):
    given = ("split=mini", "auto=false", f"outputs={tmp_path}/o")
    _, _, err = command("eval", "experiment=source_estimates", *given)
    assert err[-1] == "avn.eval: 6 of 6 jobs failed"
