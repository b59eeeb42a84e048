"""The worked examples of the README run as they stand, on small things."""

import runpy
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
    "realisations=1",
    "protocol.num_starts=4",
)
SMALL = ("split=mini", *FAST)


def test_no_example_is_longer_than_twenty_lines():
    files = [p for p in EXAMPLES.rglob("*") if p.suffix in (".py", ".yaml")]
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
    runpy.run_path(str(EXAMPLES / "beep.py"))
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
    runpy.run_path(str(EXAMPLES / "apartments.py"))
    options = (
        "split.folder=my_apartments",
        "split.name=mine",
        "protocol.num_starts=4",
        f"outputs={outputs}",
    )
    code, out, err = command("eval", "agent=random_walk", *options)
    assert code == 0, err
    assert set(pd.read_csv(Path(out[-1]) / "episodes.csv")["scene"]) == {"home"}
