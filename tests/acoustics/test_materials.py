import numpy as np
import pytest

from avn.acoustics import materials
from avn.core.errors import UserError


def test_every_name_has_coefficients_that_are_shares() -> None:
    assert set(materials.NAMES) == {
        *("parquet", "carpet", "floor_tiles", "plaster", "painted_brick", "wall_tiles"),
        *("ceiling_plaster", "glass", "wood", "upholstery", "mattress", "laminate"),
        *("ceramic", "metal", "books", "fabric"),
    }
    for table in (materials.absorption, materials.scattering):
        values = table(materials.NAMES)
        assert values.shape == (len(materials.NAMES), 6)
        assert (values > 0).all()
        assert (values < 1).all()


def test_soft_things_absorb_more_than_hard_ones() -> None:
    soft = materials.absorption(["upholstery", "mattress", "carpet", "fabric"])[:, 3]
    hard = materials.absorption(["floor_tiles", "wall_tiles", "painted_brick", "glass"])[:, 3]
    assert soft.min() > 10 * hard.max()


def test_rows_follow_the_order_of_the_names() -> None:
    both = materials.absorption(["carpet", "glass"])
    assert np.array_equal(both[1], materials.absorption(["glass"])[0])


def test_an_unknown_name_is_named() -> None:
    with pytest.raises(UserError, match=r"'velvet'.*parquet"):
        materials.absorption(["glass", "velvet"])


def test_air_attenuation_is_that_of_the_standard() -> None:
    # ISO 9613-1, table 1: dB per km at 20 degrees, 50 % humidity.
    decibel = materials.air_attenuation() * 10 / np.log(10) * 1000
    assert decibel == pytest.approx([0.445, 1.32, 2.73, 4.66, 9.86, 29.4], rel=0.03)
