"""The benchmarks follow the names of the package; they are too long to run."""

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_a_benchmark_can_be_imported(path: Path) -> None:
    assert callable(runpy.run_path(str(path))["main"])


def test_the_recipe_of_the_training_has_settings_that_exist() -> None:
    names = runpy.run_path(str(FOLDER / "reinforcement.py"))
    recipe = names["A3C"](**names["RECIPE"])
    assert (recipe.num_envs, recipe.rollout_length) == (names["N"], names["STEPS"])
