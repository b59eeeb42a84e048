"""`avn.train agent=ROW` trains the networks of the row."""

import pytest

from avn.config import option_files
from avn.config.python import compose_command
from avn.config.row_networks import with_row_networks
from avn.core.errors import UserError


@pytest.mark.parametrize(
    ("given", "network"),
    [
        ("model=sound_cnn", "cnn5"),
        ("model=sound_cnn agent=belief", "arrival"),
        ("agent=belief model=sound_cnn sound_model=cnn5", "cnn5"),
        ("model=sound_cnn agent=ours_noexp train_seed=1", "paper"),
        ("model=occupancy_cnn", "small"),
        ("model=occupancy_cnn agent=ours_noexp", "paper"),
        ("model=occupancy_cnn agent=ours_noexp mapper=occupancy", "small"),
        ("model=stop_classifier agent=ours_exp", "paper"),
        ("model=a3c_va", "cnn5"),
    ],
)
def test_the_network_is_that_of_the_row_unless_one_is_given(given, network):
    cfg, _ = compose_command("train", given.split())
    node = {"occupancy_cnn": "occupancy_model", "stop_classifier": "stop_model"}
    assert cfg[node.get(cfg.model.name, "sound_model")].name == network


def test_several_rows_have_no_common_network():
    with pytest.raises(UserError, match="agent=belief,plan_noexp: model=sound_cnn has one network"):
        with_row_networks(["-m", "model=sound_cnn", "agent=belief,plan_noexp"])
    with_row_networks(["-m", "model=sound_cnn", "train_seed=0,1"])


@pytest.mark.parametrize("text", ["", "defaults:\n", "- list\n"])
def test_a_row_of_the_user_may_choose_nothing(tmp_path, monkeypatch, text):
    (tmp_path / "agent").mkdir()
    (tmp_path / "agent" / "mine.yaml").write_text(text)
    monkeypatch.setattr(option_files, "_folders", [str(tmp_path)])
    given = ["model=sound_cnn", "agent=mine"]
    assert with_row_networks(given) == given


def test_flags_stay_where_they_are():
    given = ["--multirun", "model=sound_cnn", "agent=belief", "train_seed=0,1", "--cfg", "job"]
    found = with_row_networks(given)
    assert found == [*given[:2], "sound_model=arrival", *given[2:]]
