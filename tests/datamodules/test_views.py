import numpy as np
import pytest
import torch
from small import option
from synthetic_views import synthetic_views

from avn.core.errors import UserError
from avn.datamodules.views import COARSE, ViewData, ViewSampler, ViewSet
from avn.modules.settings import AugmentConfig

SAME = AugmentConfig(colour=0, light=0, noise=0, blur=0, erase=0, shift=0)


def test_items_name_views_of_each_apartment() -> None:
    apartments = [synthetic_views(10, 0), synthetic_views(7, 1)]
    views = ViewSet(apartments)
    assert len(views) == 17
    batch = views.__getitems__([3, 12, 17 + 12])
    expected = [apartments[0].rgb[0][3], apartments[1].rgb[0][2], apartments[1].rgb[0][2]]
    for picture, rgb in zip(batch["pictures"], expected, strict=True):
        assert torch.equal((picture * 255).round().byte(), torch.from_numpy(rgb).permute(2, 0, 1))
    assert torch.equal(batch["target"][1].bool(), torch.from_numpy(apartments[1].free[2]))
    assert torch.equal(batch["visible"][1], torch.from_numpy(apartments[1].visible[2]))
    depth = apartments[1].depth[0][2].astype(np.float32)
    assert float(batch["inverse_depth"][1, 0, 3, 4]) == pytest.approx(
        1 / depth[3 * COARSE + COARSE // 2, 4 * COARSE + COARSE // 2]
    )
    assert (batch["inverse_depth"][:, :, 0] == 0).all()  # nothing there


def test_mirrored_views_have_mirrored_windows() -> None:
    apartment = synthetic_views(40, 0)
    plain, views = ViewSet([apartment]), ViewSet([apartment], augmented=SAME, mirror=True)
    items = list(range(40))
    before, after = plain.__getitems__(items), views.__getitems__(items)
    turned = 0
    for row in items:
        flip = not torch.equal(before["pictures"][row], after["pictures"][row])
        turned += flip
        for key in before:
            wanted = before[key][row].flip(-1) if flip else before[key][row]
            assert torch.equal(after[key][row], wanted)
    assert 8 < turned < 32


def test_training_shows_all_appearances_and_measuring_the_first() -> None:
    apartment = synthetic_views(20, 0, appearances=3)
    views = ViewSet([apartment], augmented=SAME)
    seen = set()
    for realisation in range(5):
        batch = views.__getitems__([20 * realisation + state for state in range(20)])
        for state, picture in enumerate((batch["pictures"] * 255).round().byte()):
            matches = [
                appearance
                for appearance in range(3)
                if torch.equal(
                    picture.permute(1, 2, 0), torch.from_numpy(apartment.rgb[appearance][state])
                )
            ]
            seen |= set(matches)
    assert seen == {0, 1, 2}
    first = ViewSet([apartment]).__getitems__([4])["pictures"][0]
    assert torch.equal(
        (first * 255).round().byte().permute(1, 2, 0), torch.from_numpy(apartment.rgb[0][4])
    )


def test_a_batch_is_a_function_of_its_items_and_the_seed() -> None:
    apartment = synthetic_views(20, 0)
    one, other = (ViewSet([apartment], seed, AugmentConfig(), True) for seed in (0, 1))
    items = [5, 2, 19]
    assert torch.equal(one.__getitems__(items)["pictures"], one.__getitems__(items)["pictures"])
    assert not torch.equal(
        one.__getitems__(items)["pictures"], other.__getitems__(items)["pictures"]
    )
    later = [20 + item for item in items]
    assert not torch.equal(one.__getitems__(items)["pictures"], one.__getitems__(later)["pictures"])


def test_an_epoch_shows_every_view_as_often_as_it_should() -> None:
    sampler = ViewSampler(20, 7, 3)
    orders = []
    for epoch in (0, 1, 1):
        sampler.set_epoch(epoch)
        items = torch.tensor(list(sampler))
        assert len(items) == len(sampler) == 60
        assert (torch.bincount(items % 20) == 3).all()
        assert len(items.unique()) == 60
        orders.append(items)
    assert torch.equal(orders[1], orders[2])
    assert not set(orders[0].tolist()) & set(orders[1].tolist())


def test_the_prior_is_the_mean_window() -> None:
    recipe = option("occupancy_model", "small")
    apartments = [synthetic_views(10, 0), synthetic_views(30, 1)]
    data = ViewData(apartments, [synthetic_views(5, 2)], recipe)
    windows = np.concatenate([apartment.free for apartment in apartments])
    np.testing.assert_allclose(data.prior.numpy(), windows.mean(0), atol=1e-6)


def test_empty_split_is_named() -> None:
    apartment = synthetic_views(5, 0)
    for split, given in (("train", ([], [apartment])), ("validation", ([apartment], []))):
        with pytest.raises(UserError, match=f"split.{split} has no apartment"):
            ViewData(*given, option("occupancy_model", "small"))
