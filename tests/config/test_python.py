"""Configs composed from Python, also within a program that uses Hydra itself."""

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra

from avn.config.python import compose_command, composing
from avn.core.errors import UserError


def test_the_program_s_own_hydra_stays(tmp_path):
    (tmp_path / "mine.yaml").write_text("key: 1\n")
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(tmp_path), version_base="1.3"):
        for _ in range(3):
            cfg, given = compose_command("eval", ["agent=greedy", "split=mini"])
            assert (cfg.split.name, given) == ("mini", ["agent=greedy", "split=mini"])
            assert compose("mine").key == 1
            with pytest.raises(UserError, match="agent: there is no 'greddy'; there are "):
                compose_command("eval", ["agent=greddy"])
            assert compose("mine").key == 1
    assert not GlobalHydra.instance().is_initialized()


def test_it_is_gone_afterwards_where_there_was_none():
    GlobalHydra.instance().clear()
    with composing():
        assert compose("eval", overrides=["agent=greedy"]).agent.name == "greedy"
    assert not GlobalHydra.instance().is_initialized()
