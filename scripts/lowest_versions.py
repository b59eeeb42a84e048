"""Test the package with the lowest versions of its dependencies that `pyproject.toml` admits.

`python scripts/lowest_versions.py FOLDER [TEST...]` makes a virtual environment in FOLDER, installs
the lowest declared version of each direct dependency, and runs tests there. It needs about 4 GB of
disk (8 GB with PyTorch for CUDA) and some ten minutes. With `--list` it only prints the versions.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tomllib
import venv
from collections.abc import Sequence
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
# Of the extra `dev`, what the tests below need.
TOOLS = ("gymnasium", "networkx", "pytest", "pytest-xdist")
TESTS = (
    "tests/acoustics",
    "--ignore=tests/acoustics/test_tracer.py",  # against pyroomacoustics, which is compiled
    "tests/agents",
    "tests/apartments",
    "tests/config/test_cli.py",
    "tests/core",
    "tests/dataset",
    "tests/integrations",
    "--deselect=tests/integrations/test_gymnasium.py::test_stable_baselines3_learns_in_it",
    "tests/mapping",
    "tests/modules",
    "tests/navigation",
    "tests/pipeline/test_stage.py",
    "tests/pipeline/test_trained.py",
    "tests/planning",
    "tests/reporting",
    "tests/rl",
    # learning to the optimum, which is a matter of rounding
    "--ignore=tests/rl/test_learning.py",
    "tests/views/test_raycast.py",
)


def requirements(project: Path = ROOT / "pyproject.toml") -> list[Requirement]:
    """Return the dependencies of the package, and of its extras but those of the site."""
    table = tomllib.loads(project.read_text())["project"]
    extras = table["optional-dependencies"]
    lines = [
        *table["dependencies"],
        *(line for key in extras if key != "docs" for line in extras[key]),
    ]
    return [Requirement(line) for line in lines]


def lowest(requirement: Requirement) -> str | None:
    """Return the lowest declared version of a dependency, None where it declares none."""
    bounds = [own.version for own in requirement.specifier if own.operator in (">=", "==", "~=")]
    return bounds[0] if bounds else None


def pins(project: Path = ROOT / "pyproject.toml") -> list[str]:
    """Return `name==version` of each dependency of the package and of the tests, without extras."""
    table = tomllib.loads(project.read_text())["project"]
    wanted = [Requirement(line) for line in table["dependencies"]]
    tools = [Requirement(line) for line in table["optional-dependencies"]["dev"]]
    wanted += [own for own in tools if own.name in TOOLS]
    return [f"{own.name}=={lowest(own)}" for own in wanted]


def main(arguments: Sequence[str] | None = None) -> int:
    """Install the lowest versions, run the tests, and return their exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of the virtual environment")
    parser.add_argument("tests", nargs="*", default=TESTS, help="tests to run")
    parser.add_argument("--list", action="store_true", help="print the versions only")
    options = parser.parse_args(arguments)
    if options.list:
        print("\n".join(pins()))
        return 0
    python = options.folder / "bin" / "python"
    if not python.exists():
        venv.create(options.folder, with_pip=True)
    install = [python, "-m", "pip", "install", "--quiet"]
    subprocess.run([*install, *pins()], check=True)
    subprocess.run([*install, "--no-deps", "--editable", ROOT], check=True)
    # `src` of this checkout, whatever else the environment of the caller holds
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    return subprocess.run(
        [python, "-m", "pytest", "-q", *options.tests], cwd=ROOT, env=environment
    ).returncode


if __name__ == "__main__":
    sys.exit(main())
