"""Errors of arrivals: none for the truth, a right angle for a turned head."""

import pytest
import torch
from small import opened

from avn.acoustics.settings import AcousticsConfig
from avn.apartments.splits import load_split
from avn.core.heard import Arrivals
from avn.dataset.arrivals import true_arrivals
from avn.navigation.observations import SceneObservations
from avn.pipeline.arrival_errors import errors_by_scene

REGIME = AcousticsConfig("diffraction", "diffraction")


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    from small import composed

    from avn.core.settings import typed

    plan = load_split(typed(composed("split=mini").split))["test"][0]
    return opened(plan, REGIME, tmp_path_factory.mktemp("scene"))


def errors(scene, heard):
    observed = SceneObservations({"arrival": heard[:, :, None, None]})
    return errors_by_scene([scene], [observed], REGIME).set_index("sight")


def test_the_truth_has_no_error(scene):
    found = errors(scene, true_arrivals(scene, REGIME))
    assert set(found.index) == {"in_sight", "out_of_sight"}
    assert found["arrival_deg"].max() < 1.0
    assert found["log_length"].max() == 0.0
    assert found["behind"].max() == 0.0
    assert found["clips"].sum() <= 1000


def test_a_quarter_turn_and_half_the_length_are_found(scene):
    heard = true_arrivals(scene, REGIME)
    turned = heard.clone()
    Arrivals(turned).bearing.copy_(Arrivals(heard).bearing.roll(18, -1))
    Arrivals(turned).distance[..., 0] += torch.tensor(0.5).log()
    found = errors(scene, turned)
    assert found["arrival_deg"].to_numpy() == pytest.approx(90.0, abs=1.0)
    assert found["log_length"].to_numpy() == pytest.approx(0.6931, abs=1e-3)
