"""`avn.train agent=ROW` trains the networks of the row."""

import pytest

from avn.config.python import compose_command
from avn.config.row_networks import with_row_networks


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
    cfg, _ = compose_command("train", with_row_networks(given.split()))
    node = {"occupancy_cnn": "occupancy_model", "stop_classifier": "stop_model"}
    assert cfg[node.get(cfg.model.name, "sound_model")].name == network


def test_flags_stay_where_they_are():
    given = ["--multirun", "model=sound_cnn", "agent=belief", "train_seed=0,1", "--cfg", "job"]
    found = with_row_networks(given)
    assert found == [*given[:2], "sound_model=arrival", *given[2:]]
