"""Features in scene folders: read back as written, and refused by name where they are others."""

from __future__ import annotations

import numpy as np
import pytest

from avn.core.errors import UserError
from avn.dataset.features import features_file, read_features, write_features

FEATURES = np.random.default_rng(0).normal(size=(8, 5)).astype(np.float32)


@pytest.fixture
def folder(tmp_path):
    write_features(tmp_path, "lite", FEATURES, "abc", "views")
    return tmp_path


def refusal(call) -> str:
    with pytest.raises(UserError) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_read_back(folder) -> None:
    assert (read_features(folder, "lite", 8, "abc", "views") == FEATURES).all()
    assert (read_features(folder, "lite", 8) == FEATURES).all()


def test_looks_lie_side_by_side(folder) -> None:
    write_features(folder, "lite", FEATURES + 1, "def", "views", look=2)
    assert (read_features(folder, "lite", 8, "def", look=2) == FEATURES + 1).all()
    assert (read_features(folder, "lite", 8, "abc") == FEATURES).all()


def test_refused(folder) -> None:
    path = features_file(folder, "lite")
    assert "no such scene file" in refusal(lambda: read_features(folder, "resnet18", 8))
    assert str(path) in refusal(lambda: read_features(folder, "lite", 8, "other"))
    assert "other views" in refusal(lambda: read_features(folder, "lite", 8, "abc", "newer"))
    assert "(8, 5)" in refusal(lambda: read_features(folder, "lite", 12, "abc"))
    path.rename(features_file(folder, "resnet18"))
    line = refusal(lambda: read_features(folder, "resnet18", 8))
    assert "features-lite" in line
    assert "features-resnet18" in line


def test_equal_features_equal_bytes(folder, tmp_path_factory) -> None:
    other = tmp_path_factory.mktemp("other")
    write_features(other, "lite", FEATURES, "abc", "views")
    files = [features_file(where, "lite").read_bytes() for where in (folder, other)]
    assert files[0] == files[1]
