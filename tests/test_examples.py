"""The worked examples of the README run as they stand, on small things."""

import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from small import fitting

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
FAST = (
    "processes=1",
    "acoustics.rays=300",
    "acoustics.seconds=0.2",
    "sound_model.epochs=1",
    "sound_model.validation_clips=100",
    "realisations=1",
    "protocol.num_starts=4",
)
SMALL = ("split=mini", *FAST)


# The learners of two libraries are as long as the libraries make them.
LONG = ("cleanrl_ppo.py", "torchrl_ppo.py")
# Settings of the environment that the learners learn in; as in tests/integrations.
WORLD = (
    *SMALL[:4],
    "sound_model.epochs=1",
    "sound_model.validation_clips=100",
    "algorithm.realisations=1",
    "renderer.camera.size=32",
    "renderer.samples=1",
    "renderer.light.gather_rays=4",
    "renderer.light.shadow_rays=2",
    "renderer.light.spacing=0.3",
    "backbone.size=32",
)


def run_example(name, folder, *arguments):
    """Run an example as its user does, in a folder of the user."""
    environment = os.environ | {"PYTHONPATH": str(EXAMPLES.parents[1] / "src")}
    return subprocess.run(
        [sys.executable, str(EXAMPLES / name), *arguments],
        cwd=folder,
        env=environment | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


def test_no_example_is_longer_than_twenty_lines():
    files = [p for p in EXAMPLES.rglob("*") if p.suffix in (".py", ".yaml")]
    files = [path for path in files if path.name not in LONG]
    assert len(files) >= 6
    for path in files:
        code = [line for line in path.read_text().splitlines() if line.strip()]
        assert len(code) <= 20, path


def test_an_agent_of_ones_own_walks(command, outputs, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    options = (
        "agent=right_hand",
        *fitting("agent=greedy", *SMALL),
        f"outputs={outputs}",
        "sound=alarm",
    )
    code, out, err = command("eval", "--config-dir", str(EXAMPLES / "conf"), *options)
    assert code == 0, err
    assert set(pd.read_csv(Path(out[-1]) / "episodes.csv")["agent"]) == {"right_hand"}


def test_a_sound_model_of_ones_own_is_trained(command, outputs):
    options = (
        "model=sound_cnn",
        "sound_model=wide",
        *fitting("model=sound_cnn", *SMALL),
        f"outputs={outputs}",
    )
    code, out, err = command("train", "--config-dir", str(EXAMPLES / "conf"), *options)
    assert code == 0, err
    assert "widths:\n  - 32" in (Path(out[-1]) / "model_card.md").read_text()


@pytest.mark.parametrize("sound", ["beep.wav", "phones"])
def test_a_sound_of_ones_own_is_heard(command, outputs, tmp_path, monkeypatch, sound):
    monkeypatch.chdir(tmp_path)
    assert run_example("beep.py", tmp_path).returncode == 0
    where = () if sound == "beep.wav" else ("--config-dir", str(tmp_path / "my_conf"))
    options = (
        "agent=greedy",
        f"sound={sound}",
        *fitting("agent=greedy", *SMALL),
        f"outputs={outputs}",
    )
    code, out, err = command("eval", *where, *options)
    assert code == 0, err
    assert "beep" in set(pd.read_csv(Path(out[-1]) / "episodes.csv")["sound"])


def test_an_apartment_of_ones_own_is_walked(command, outputs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_example("apartments.py", tmp_path).returncode == 0
    options = (
        "split.folder=my_apartments",
        "split.name=mine",
        "protocol.num_starts=4",
        f"outputs={outputs}",
    )
    code, out, err = command("eval", "agent=random_walk", *options)
    assert code == 0, err
    assert set(pd.read_csv(Path(out[-1]) / "episodes.csv")["scene"]) == {"home"}


def test_no_example_hides_a_package():
    """`python FILE` puts the folder of the file first on the path."""
    names = {path.stem for path in EXAMPLES.glob("*.py")}
    assert not names & {"stable_baselines3", "torchrl", "cleanrl", "gymnasium", "torch", "avn"}


@pytest.mark.parametrize("name", ["sb3_ppo", "torchrl_ppo", "cleanrl_ppo"])
def test_a_learner_of_another_library_learns_and_is_evaluated(
    command, outputs, tmp_path, monkeypatch, name
):
    pytest.importorskip({"sb3_ppo": "stable_baselines3"}.get(name, "torchrl"))
    options = (*WORLD, f"outputs={outputs}")
    run = run_example(f"{name}.py", tmp_path, "2048", *options)
    assert run.returncode == 0, run.stderr
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(EXAMPLES)
    evaluated = [own for own in options if not own.startswith("algorithm.")]
    chosen = ("agent=external", f"policy={name}:Policy", "protocol.num_starts=2")
    code, out, err = command("eval", *chosen, *evaluated)
    assert code == 0, err
    found = pd.read_csv(Path(out[-1]) / "episodes.csv")
    assert set(found["agent"]) == {f"{name}.Policy"}
    assert found["end_cell"].nunique() > 1


def test_a_policy_written_by_hand_is_evaluated(command, outputs, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    options = fitting("agent=greedy", *SMALL)
    observes = "baseline.observations=[source_estimate,collided]"
    chosen = ("agent=external", "policy=hand_written:act", observes, f"outputs={outputs}")
    code, out, err = command("eval", *chosen, *options)
    assert code == 0, err
    assert set(pd.read_csv(Path(out[-1]) / "episodes.csv")["agent"]) == {"hand_written.act"}
