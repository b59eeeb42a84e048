"""Agents of the rows, as their configs describe them."""

from pathlib import Path

import pytest
from small import composed

from avn.config.folder import conf_folder
from avn.pipeline.agent import build_agent
from avn.pipeline.sound_network import has_sound_model


@pytest.mark.parametrize(
    "row", sorted(path.stem for path in (Path(conf_folder()) / "agent").glob("*.yaml"))
)
def test_only_rows_that_say_so_are_shown_the_truth(row):
    cfg = composed(f"agent={row}", "split=mini")
    agent = build_agent(cfg)
    assert agent.privileged == cfg.agent.privileged == (row == "oracle")
    assert "source_estimate" not in agent.needs or has_sound_model(cfg)
