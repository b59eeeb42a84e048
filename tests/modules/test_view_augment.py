import pytest
import torch

from avn.modules.settings import AugmentConfig
from avn.modules.view_augment import augment

NOTHING = {"colour": 0.0, "light": 0.0, "noise": 0.0, "blur": 0.0, "erase": 0, "shift": 0}


@pytest.fixture
def pictures() -> torch.Tensor:
    return torch.rand(6, 3, 32, 32, generator=torch.Generator().manual_seed(0))


def changed(pictures: torch.Tensor, seed: int = 0, **some: float) -> torch.Tensor:
    config = AugmentConfig(**{**NOTHING, **some})
    return augment(pictures, config, torch.Generator().manual_seed(seed))


def test_nothing_is_changed_where_all_is_off(pictures: torch.Tensor) -> None:
    assert torch.equal(changed(pictures), pictures)


@pytest.mark.parametrize("key", list(NOTHING))
def test_each_thing_changes_pictures_in_a_way_of_its_own(pictures: torch.Tensor, key: str) -> None:
    strength = {"erase": 3, "shift": 3, "noise": 0.1}.get(key, 1.0)
    first, again = (changed(pictures, **{key: strength}) for _ in range(2))
    assert torch.equal(first, again)
    if key == "blur":  # all of them are blurred
        assert not torch.equal(first, pictures)
        return
    assert not torch.equal(first, changed(pictures, seed=1, **{key: strength}))
    assert first.shape == pictures.shape
    assert float(first.min()) >= 0
    assert float(first.max()) <= 1
    # The same picture, given six times, is changed in several ways.
    same = changed(pictures[:1].expand(6, -1, -1, -1), **{key: strength})
    assert len({float(picture.sum()) for picture in same}) > 3


def test_grey_stays_grey_but_for_the_tint() -> None:
    grey = torch.full((4, 3, 8, 8), 0.4)
    found = changed(grey, colour=1.0)
    # Turning and fading colours leave grey as it is; the light's tint is the same everywhere.
    assert torch.allclose(found, found[:, :, :1, :1].expand_as(found), atol=1e-6)
    tint = found[:, :, 0, 0] / 0.4
    assert float(tint.min()) > 2**-0.41
    assert float(tint.max()) < 2**0.41


def test_a_shift_moves_the_picture_by_whole_pixels() -> None:
    pictures = torch.zeros(8, 3, 16, 16)
    pictures[:, :, 8, 8] = 1.0
    places = changed(pictures, shift=3)[:, 0].nonzero()[:, 1:]
    assert len(places) == 8
    assert int((places - 8).abs().max()) <= 3
    assert len({tuple(place) for place in places.tolist()}) > 3
