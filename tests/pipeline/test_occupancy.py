"""How well an occupancy network does, in each scene and in all."""

import pytest
import torch
from small import composed
from synthetic_scene import synthetic_scene

from avn.core.errors import UserError
from avn.modules.local_patch_metrics import local_patch_metrics
from avn.pipeline.apartments import Apartments
from avn.pipeline.observations import Observed
from avn.pipeline.occupancy import (
    LocalPatches,
    local_patch_errors,
    sees_rooms,
    true_local_patches,
)
from avn.views.settings import CameraConfig


def test_errors_are_of_each_scene_and_of_all():
    camera, scenes = CameraConfig(), [synthetic_scene("a"), synthetic_scene("b", 2.5)]
    truths = [true_local_patches(scene.plan, camera) for scene in scenes]
    # A perfect estimate.
    estimates = [free.float() * 0.98 + 0.01 for free, _ in truths]
    prior = torch.full((5, 5), 0.7)
    table = local_patch_errors(scenes, camera, estimates, prior).set_index(["scene", "by", "cells"])
    assert table.loc[("a", "network", "visible"), "auc"] == pytest.approx(1.0)
    assert table.loc[("all", "network", "all"), "accuracy"] == pytest.approx(1.0)
    assert table.loc[("all", "prior", "all"), "auc"] == pytest.approx(0.5)
    free, visible = (torch.cat(each) for each in zip(*truths, strict=True))
    expected = local_patch_metrics(torch.full_like(free, 0.7, dtype=torch.float), free, visible)
    assert table.loc[("all", "prior", "visible"), "ece"] == pytest.approx(expected["ece/visible"])
    assert len(table) == 3 * 2 * 2


def test_cells_that_are_not_visible_enough_tell_nothing():
    free, visible = torch.rand(2, 3, 5, 5, generator=torch.Generator().manual_seed(0)).unbind(0)

    class Given(LocalPatches):
        def load(self):
            return [torch.stack((free, visible), dim=1)]

    for least, share in ((0.0, 1.0), (0.4, 0.6), (1.1, 0.0)):
        cfg = composed("agent=plan_noexp", "split=mini", f"mapper.visible_above={least}")
        (trusted,) = Given(cfg, Apartments(cfg, "test")).trusted()
        told = ~trusted.isnan()
        assert torch.equal(told, visible >= least)
        assert torch.equal(trusted[told], free[told])
        assert told.float().mean() == pytest.approx(share, abs=0.1)


def test_rooms_are_observed_of_a_network_that_tells_them() -> None:
    told = composed("agent=belief", "split=mini")
    assert sees_rooms(told)
    assert not sees_rooms(composed("agent=plan_noexp", "split=mini"))
    assert not sees_rooms(composed("agent=greedy", "split=mini"))

    class Given(LocalPatches):
        def load(self):
            return [torch.full((2, 3, 5, 5), 0.5) * torch.tensor((1.0, 0.5, 0.2)).view(1, 3, 1, 1)]

    patches = Given(told, Apartments(told, "test"))
    assert torch.equal(patches.rooms()[0], torch.full((2, 5, 5), 0.1))
    assert torch.equal(patches.trusted()[0], torch.full((2, 5, 5), 0.5))


def test_a_map_of_rooms_needs_a_network_that_tells_them() -> None:
    cfg = composed("agent=belief", "split=mini", "occupancy_model=small")
    with pytest.raises(UserError, match=r"needs the observation 'local_rooms': choose what tells"):
        Observed(Apartments(cfg, "test"), ("local_rooms",)).check("belief", ("local_rooms",))
