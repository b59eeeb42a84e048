"""Networks as stages: what is there is reused, what is missing made, what is damaged named."""

from pathlib import Path

import pytest
import torch
from omegaconf import OmegaConf
from synthetic_scene import synthetic_scene

from avn.core.errors import UserError
from avn.pipeline.per_scene import Outcome
from avn.pipeline.trained import METRICS, read_metrics


def outcome(**changes):
    given = {"stage": "see", "what": "small", "kind": "windows", "dataset": "probabilities"}
    given |= {"version": 1, "made_from": "ab" * 32, "title": "what is seen", "seconds": 1.0}
    return Outcome(**{**given, **changes})


def config(folder, auto=True):
    return OmegaConf.create({"outputs": str(folder), "auto": auto})


def test_each_apartment_is_made_once(tmp_path):
    scenes = [synthetic_scene("a"), synthetic_scene("b")]
    made = []

    def make(scene):
        made.append(scene.name)
        return torch.full((3, 2), float(len(made)))

    found = outcome().of(config(tmp_path), scenes[:1], ["one"], make)
    assert made == ["a"]
    again = outcome().of(config(tmp_path), scenes, ["one", "two"], make)
    assert made == ["a", "b"]
    assert torch.equal(found[0], again[0])
    assert float(again[1][0, 0]) == 2
    # An apartment that has changed is made anew, and so is all that another network makes.
    outcome().of(config(tmp_path), scenes[:1], ["changed"], make)
    outcome(made_from="cd" * 32).of(config(tmp_path), scenes[:1], ["one"], make)
    assert made == ["a", "b", "a", "a"]


def test_what_is_missing_is_refused_with_auto_false(tmp_path):
    with pytest.raises(UserError, match=r"what is seen in a is missing and auto=false"):
        outcome().of(config(tmp_path, auto=False), [synthetic_scene("a")], ["one"], torch.ones)


def test_a_damaged_file_is_one_line(tmp_path):
    def run():
        return outcome().of(
            config(tmp_path), [synthetic_scene("a")], ["one"], lambda _: torch.ones(4)
        )

    run()
    (path,) = Path(tmp_path).rglob("*.h5")
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(UserError, match="cut short") as caught:
        run()
    assert str(path) in str(caught.value)


def test_damaged_metrics_are_one_line(tmp_path):
    (tmp_path / METRICS).write_text("{")
    with pytest.raises(UserError, match=r"metrics\.json: damaged; delete"):
        read_metrics(tmp_path)
