"""Distractors sound elsewhere and are of another category."""

import numpy as np
import pytest

from avn.core.errors import UserError
from avn.core.random import derive, scramble
from avn.navigation.distractor import Distractor

COUNT = 9_000
KEYS = scramble(derive("test"), np.arange(COUNT))
CATEGORIES = {"bark": "dog", "growl": "dog", "ring": "telephone", "tap": "water"}
SOURCE, SOUND = np.arange(COUNT) % 3, np.arange(COUNT) // 3 % 4


def drawn(categories=None, sources=3):
    found = Distractor(categories or CATEGORIES).draw(KEYS, SOURCE, SOUND, sources, [*CATEGORIES])
    return [own.numpy() for own in found]


def test_place_and_category_are_others_and_all_are_drawn():
    source, sound = drawn()
    assert (source != SOURCE).all()
    kinds = np.array([*CATEGORIES.values()])
    assert (kinds[sound] != kinds[SOUND]).all()
    for own in range(3):
        counts = np.bincount(source[own == SOURCE], minlength=3)
        assert counts[own] == 0
        assert np.abs(np.delete(counts, own) / (COUNT / 3) - 0.5).max() < 0.05
    # of a dog: the telephone or the water; of the telephone: one of three
    for own, others in ((0, {2, 3}), (1, {2, 3}), (2, {0, 1, 3}), (3, {0, 1, 2})):
        found, counts = np.unique(sound[own == SOUND], return_counts=True)
        assert set(found) == others
        assert np.abs(counts / counts.sum() - 1 / len(others)).max() < 0.05


def test_where_there_is_no_place_or_no_other_category_it_is_said():
    with pytest.raises(UserError, match="distractor: an apartment has one source"):
        drawn(sources=1)
    with pytest.raises(UserError, match="distractor: all sounds are of one category"):
        drawn(dict.fromkeys(CATEGORIES, "dog"))
