"""Which settings enter the hash of the occupancy network, and what refuses to see."""

import pytest
import torch
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from synthetic_scene import synthetic_scene

from avn.config import folder, schema
from avn.core.errors import UserError
from avn.modules.window_metrics import window_metrics
from avn.pipeline import occupancy


@pytest.fixture(scope="module")
def composed():
    schema.register()
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(folder.conf_folder()), version_base="1.3"):
        yield lambda *overrides: compose(
            "eval", overrides=["mapper=occupancy", "split=mini", *overrides]
        )


@pytest.mark.parametrize(
    ("override", "changes"),
    [
        ("outputs=elsewhere", False),
        ("processes=1", False),
        # the map's settings are no part of the network
        ("mapper.size=51", False),
        ("sound_model=cnn5", False),
        ("acoustics=diffraction", False),
        ("occupancy_model.epochs=3", True),
        ("occupancy_model.looks=3", True),
        ("occupancy_model.augment.colour=0.5", True),
        ("train_seed=2", True),
        ("renderer.camera.pitch=-20", True),
        ("split.seed=9", True),
    ],
)
def test_a_setting_enters_the_hash_of_what_it_changes(composed, override, changes):
    before, after = composed(), composed(override)
    assert (occupancy.model_hash(before) != occupancy.model_hash(after)) == changes
    assert (occupancy.see_hash(before) != occupancy.see_hash(after)) == changes


@pytest.mark.parametrize("name", ["occupancy_cnn", "see"])
def test_a_raised_version_makes_anew_what_depends_on_it(composed, monkeypatch, name):
    before = occupancy.see_hash(composed())
    monkeypatch.setitem(occupancy.VERSIONS, name, occupancy.VERSIONS[name] + 1)
    assert occupancy.see_hash(composed()) != before


def test_a_mapper_without_a_network_sees_nothing(composed):
    cfg = composed("mapper=none")
    assert not occupancy.sees_windows(cfg)
    with pytest.raises(UserError, match="occupancy_model: 'none' sees no free cells"):
        occupancy.occupancy_model(cfg)


def test_errors_are_of_each_room_and_of_all(composed, monkeypatch):
    monkeypatch.setattr(occupancy, "window_prior", lambda _: torch.full((5, 5), 0.7))
    cfg, rooms = composed(), [synthetic_scene("a"), synthetic_scene("b", 2.5)]
    truths = [occupancy.true_windows(cfg, room) for room in rooms]
    # A perfect estimate.
    estimates = [free.float() * 0.98 + 0.01 for free, _ in truths]
    table = occupancy.window_errors(cfg, rooms, estimates).set_index(["room", "by", "cells"])
    assert table.loc[("a", "network", "visible"), "auc"] == pytest.approx(1.0)
    assert table.loc[("all", "network", "all"), "accuracy"] == pytest.approx(1.0)
    assert table.loc[("all", "prior", "all"), "auc"] == pytest.approx(0.5)
    free, visible = (torch.cat(each) for each in zip(*truths, strict=True))
    expected = window_metrics(torch.full_like(free, 0.7, dtype=torch.float), free, visible)
    assert table.loc[("all", "prior", "visible"), "ece"] == pytest.approx(expected["ece/visible"])
    assert len(table) == 3 * 2 * 2
