import itertools

import numpy as np
import pytest

from avn.apartments.splits import PARTS
from avn.views.appearance_palettes import COLOURS, LAYOUTS, LIGHT
from avn.views.textures import PIXELS, outdoors, pattern

MATERIALS = (
    "parquet",
    "carpet",
    "floor_tiles",
    "wall_tiles",
    "plaster",
    "painted_brick",
    "ceiling_plaster",
)


@pytest.mark.parametrize(("first", "second"), itertools.combinations(PARTS, 2))
def test_no_colour_layout_or_light_stands_in_two_pools(first, second):
    assert COLOURS[first].keys() == COLOURS[second].keys()
    for kind in COLOURS[first]:
        assert not set(COLOURS[first][kind]) & set(COLOURS[second][kind]), kind
    assert not set(LIGHT[first]) & set(LIGHT[second])
    for kind in LAYOUTS[first]:
        shared = set(LAYOUTS[first][kind]) & set(LAYOUTS[second][kind])
        assert shared <= {("plain",)}, kind  # plain paint is told apart by its colour


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("material", MATERIALS)
def test_a_pattern_goes_on_over_its_edges(part, material):
    """The step from the last row to the first is no larger than steps within."""
    for draw in range(4):
        picture = pattern(material, part, "somewhere", draw).picture.astype(int)
        assert picture.shape == (PIXELS, PIXELS, 3)
        for axis in (0, 1):
            steps = np.abs(np.diff(picture, axis=axis)).mean(axis=(1 - axis, 2))
            seam = np.abs(picture.take(0, axis) - picture.take(-1, axis)).mean()
            assert seam <= steps.max() * 1.3 + 2


def test_rooms_of_one_pool_differ_and_draws_repeat():
    made = [pattern("plaster", "train", "flat", room).picture for room in range(12)]
    again = pattern("plaster", "train", "flat", 0).picture
    np.testing.assert_array_equal(made[0], again)
    means = np.array([picture.mean(axis=(0, 1)) for picture in made])
    apart = np.abs(means[:, None] - means[None]).max(axis=2)
    assert (apart[~np.eye(12, dtype=bool)] > 0).all()
    assert apart.max() > 30


def test_materials_that_no_pool_names_are_painted():
    for part in PARTS:
        for room in range(4):
            picture = pattern("glass", part, "flat", room).picture
            assert picture.shape == (PIXELS, PIXELS, 3)
            mean = picture.mean(axis=(0, 1))
            paints = np.array(COLOURS[part]["plaster"])
            assert np.abs(paints - mean).max(axis=1).min() < 15  # one of the pool's, a little off


def test_the_sky_is_above_and_brighter_than_the_ground():
    for part in PARTS:
        picture = outdoors(part, "flat").picture.astype(int)
        assert picture[:40].mean() > picture[-20:].mean() + 20
