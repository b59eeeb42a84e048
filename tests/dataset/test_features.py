"""Features of views: read back as written, and refused by name where they are others."""

from __future__ import annotations

import numpy as np
import pytest

from avn.core.errors import UserError
from avn.dataset.features import read_features, write_features

FEATURES = np.random.default_rng(0).normal(size=(8, 5)).astype(np.float32)


@pytest.fixture
def path(tmp_path):
    write_features(tmp_path / "features-lite.h5", FEATURES, "abc")
    return tmp_path / "features-lite.h5"


def missing_error(call) -> str:
    with pytest.raises(UserError) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_read_back(path) -> None:
    assert (read_features(path, 8, "abc") == FEATURES).all()
    assert (read_features(path, 8) == FEATURES).all()


def test_refused(path) -> None:
    other = path.with_name("features-resnet18.h5")
    assert "no such scene file" in missing_error(lambda: read_features(other, 8))
    assert str(path) in missing_error(lambda: read_features(path, 8, "other"))
    assert "(8, 5)" in missing_error(lambda: read_features(path, 12, "abc"))


def test_equal_features_equal_bytes(path, tmp_path) -> None:
    write_features(tmp_path / "again.h5", FEATURES, "abc")
    assert path.read_bytes() == (tmp_path / "again.h5").read_bytes()
