"""Policies of the user walk the episodes of `avn.eval`."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

POLICIES = """
import numpy as np
import torch

import helper

def seven(observations):
    return [7] * len(observations["odometry"])

def floats(observations):
    return observations["odometry"][:, 0] * 1.5

def pair(observations):
    return np.zeros(len(observations["odometry"]), int), None

def short(observations):
    return [0]

def tensors(observations):
    assert all(isinstance(value, np.ndarray) for value in observations.values())
    return torch.full((len(observations["odometry"]),), helper.ACTION, dtype=torch.int32)

def sampled(observations):
    return np.random.randint(4, size=len(observations["odometry"]))

number = 3

class Player:
    def __init__(self, weights: str = "weights.txt", action: int = 2):
        self.action = action

    def reset(self, n):
        self.n = n

    def __call__(self, observations):
        return np.full(self.n, self.action)
"""
OWN = "baseline.observations=[odometry,collided]"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of the policies, in which the command runs."""
    (tmp_path / "policies.py").write_text(POLICIES)
    (tmp_path / "helper.py").write_text("ACTION = 1\n")
    (tmp_path / "weights.txt").write_text("0")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("policies", "helper"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return tmp_path


@pytest.fixture
def run(command, outputs, folder):
    def go(policy, *options):
        given = ("agent=external", f"policy=policies:{policy}", "split=mini", OWN, *options)
        return command("eval", *given, "protocol.num_starts=3", f"outputs={outputs}")

    return go


def folder_of(found):
    code, out, err = found
    assert code == 0, err
    return Path(out[-1])


def test_a_row_is_named_after_the_policy(run):
    found = pd.read_csv(folder_of(run("tensors")) / "episodes.csv")
    assert set(found["agent"]) == {"policies.tensors"}
    assert (found["actions"] > 0).all()


def test_a_policy_that_samples_gives_the_same_episodes_again(run, outputs):
    folder = folder_of(run("sampled"))
    first = (folder / "episodes.csv").read_bytes()
    (folder / "results.csv").unlink()
    np.random.seed(5)  # noqa: NPY002
    assert (folder_of(run("sampled")) / "episodes.csv").read_bytes() == first


def test_a_run_belongs_to_the_code_and_the_files_of_its_policy(run, folder, monkeypatch):
    first = folder_of(run("Player"))
    assert folder_of(run("Player")) == first
    assert folder_of(run("Player", "baseline.settings={action: 3}")) != first
    (folder / "weights.txt").write_text("1")
    second = folder_of(run("Player"))
    assert second != first
    (folder / "helper.py").write_text("ACTION = 3\n")
    for name in ("policies", "helper"):  # as in a new process
        monkeypatch.delitem(sys.modules, name)
    assert folder_of(run("Player")) not in (first, second)


@pytest.mark.parametrize(
    ("policy", "options", "line"),
    [
        ("seven", (), "policy policies:seven: 7 is no action under protocol 'var'.*0 to 3"),
        ("floats", (), "policy policies:floats: returned float64 values.*integers"),
        ("pair", (), "policy policies:pair: returned a tuple"),
        ("short", (), "policy policies:short: returned int64 values of shape .1,."),
        ("nothing", (), "policy: 'policies:nothing' cannot be imported"),
        ("number", (), "policy: 'policies:number' is a int, which cannot be called"),
        ("Player", ("baseline.settings={width: 3}",), "baseline.settings: .*width.*takes"),
        ("seven", ("baseline.observations=[rgb]",), "'rgb'; there are source_estimate.*view"),
        ("seven", ("baseline.map_width=3",), "baseline.map_width: not read"),
        ("seven", ("policy=seven",), "give module:name"),
    ],
)
def test_a_mistake_is_one_line(run, policy, options, line):
    code, _, err = run(policy, *options)
    assert code == 2, err
    lines = [own for own in err if own.startswith("avn.eval")]
    assert len(lines) == 1
    assert pd.Series(lines).str.contains(line).all(), lines


def test_waveforms_are_what_the_sound_network_hears(outputs):
    """Applied to the waveforms, it gives the source estimates of the same clips."""
    import avn
    from avn.config.python import compose_command
    from avn.pipeline.sound_network import SoundNetwork

    overrides = ["split=mini", "processes=1", "acoustics.rays=300", "acoustics.seconds=0.2"]
    overrides += ["sound_model.epochs=1", f"outputs={outputs}", "algorithm.realisations=1"]
    overrides += ["sound_model.validation_clips=100"]
    names = ["waveform", "spectrogram", "source_estimate"]
    env = avn.make_env(overrides, num_envs=8, observations=names, part="validation")
    cfg, _ = compose_command("eval", ["agent=external", *overrides])
    network = SoundNetwork(cfg).load()
    seen = env.reset()
    for _ in range(3):
        with torch.no_grad():
            heard = network(seen["waveform"])
            pictures = network.spectrogram(seen["waveform"])
        torch.testing.assert_close(heard, seen["source_estimate"], rtol=1e-3, atol=1e-3)
        torch.testing.assert_close(pictures, seen["spectrogram"], rtol=1e-4, atol=1e-4)
        action = torch.randint(4, (8,))
        seen = env.step(seen.set("action", action))["next"]
