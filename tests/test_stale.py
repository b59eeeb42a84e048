"""No answer is an old one: the user's own code is part of what a product is made from."""

import importlib
from pathlib import Path

import pandas as pd
import pytest
import yaml
from small import A3C, EYES, SMALL, fitting

from avn.reporting.finished_run import RESULTS

AGENT = """
import torch
from rule import ACTION
from avn.agents.base import Agent


class Stubborn(Agent):
    def reset(self, episodes, generator, protocol):
        self.episodes = episodes

    def act(self, observation):
        return torch.full((self.episodes,), ACTION, dtype=torch.long)
"""


@pytest.fixture
def walk(tmp_path, monkeypatch, command, outputs):
    """Evaluate the user's agent; returns the folder of its run."""
    (tmp_path / "stubborn.py").write_text(AGENT)
    config = tmp_path / "conf" / "baseline" / "stubborn.yaml"
    config.parent.mkdir(parents=True)
    config.write_text(yaml.safe_dump({"_target_": "stubborn.Stubborn"}))
    monkeypatch.syspath_prepend(tmp_path)

    def go(rule, *options):
        (tmp_path / "rule.py").write_text(f"ACTION = {rule}\n")
        for name in ("rule", "stubborn"):  # as in a new process
            if name in importlib.sys.modules:
                del importlib.sys.modules[name]
        importlib.invalidate_caches()
        chosen = "agent=random_walk"
        code, out, err = command(
            "eval",
            *("--config-dir", str(tmp_path / "conf"), chosen, "baseline=stubborn"),
            *fitting(chosen, *SMALL, *EYES, *A3C),
            f"outputs={outputs}",
            *options,
        )
        assert code == 0, err
        return Path(out[-1])

    return go


def test_an_edited_agent_is_evaluated_anew(walk):
    forward, turning = walk("0"), walk("2")
    assert forward != turning
    assert walk("0") == forward
    records = [pd.read_csv(run / "episodes.csv") for run in (forward, turning)]
    assert records[0]["collisions"].sum() > records[1]["collisions"].sum() == 0


def test_force_makes_the_run_anew_and_nothing_else(walk, outputs):
    run = walk("3")
    made, needed = (run / RESULTS).stat().st_mtime_ns, _times(outputs / "generate")
    (run / "left_over.png").write_text("of the old run")
    assert walk("3") == run
    assert (run / RESULTS).stat().st_mtime_ns == made
    assert walk("3", "force=true") == run
    assert (run / RESULTS).stat().st_mtime_ns > made
    assert not (run / "left_over.png").exists()
    assert _times(outputs / "generate") == needed


def _times(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.h5")}
