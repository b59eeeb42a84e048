"""A second source can be drawn among as many places as each apartment has."""

import numpy as np

from avn.core.random import derive, scramble
from avn.core.second_source import draw_second_source


def test_each_apartment_has_its_own_number_of_places():
    count = 3_000
    keys = scramble(derive("test"), np.arange(count))
    sources = np.where(np.arange(count) % 2, 2, 5)
    source, sound = np.arange(count) % sources, np.arange(count) % 3
    found, other = draw_second_source(keys, source, sound, sources, ["dog", "dog", "bell"])
    assert (found.numpy() != source).all()
    assert (found.numpy() < sources).all()
    assert set(found.numpy()[sources == 5]) == set(range(5))
    assert (other.numpy()[sound < 2] == 2).all()
    assert set(other.numpy()[sound == 2]) == {0, 1}
