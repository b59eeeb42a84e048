"""How sound arrives: straight where the source is in the line of sight, else around corners."""

import numpy as np
import pytest
import torch
from small import opened

from avn.acoustics.direct_path import find_paths
from avn.acoustics.settings import AcousticsConfig
from avn.apartments.generator import generate
from avn.apartments.walls import walls
from avn.dataset.arrivals import arrivals
from avn.dataset.source_locations import locate_sources

STRAIGHT = AcousticsConfig(rays=200, seconds=0.1)
ROUND = AcousticsConfig(name="diffraction", direct_path="diffraction", rays=200, seconds=0.1)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return opened(
        generate(3, "flat", sources=3, size="small"), STRAIGHT, tmp_path_factory.mktemp("a")
    )


def test_in_transmission_sound_comes_from_the_source(scene):
    found, (locations, _) = arrivals(scene, STRAIGHT), locate_sources(scene)
    assert torch.equal(found[..., 3:], locations)
    metres = locations.norm(dim=-1)
    away = metres > 0
    assert torch.allclose(found[..., :2][away], (locations / metres[..., None])[away], atol=1e-5)
    rise = STRAIGHT.source_height - STRAIGHT.receiver_height
    length = (metres.square() + rise**2).sqrt()
    assert torch.allclose(found[..., 2].exp()[away], length[away], rtol=1e-5)
    assert (found[..., :2][~away] == 0).all()


def test_in_diffraction_it_comes_around_corners(scene):
    straight, bent = arrivals(scene, STRAIGHT), arrivals(scene, ROUND)
    _, in_sight = locate_sources(scene)
    assert torch.allclose(straight[in_sight], bent[in_sight], atol=1e-5)
    longer = bent[..., 2] - straight[..., 2]
    assert (longer > -1e-5).all()
    assert (longer > 0.05).any()
    turned = (straight[..., :2] * bent[..., :2]).sum(-1) < 0.9
    assert (longer[turned & (straight[..., :2].norm(dim=-1) > 0)] > 0).all()


def test_headings_are_quarter_turns_of_one_direction(scene):
    found = arrivals(scene, ROUND).unflatten(1, (-1, 4))
    for heading in range(3):
        right, front = found[:, :, heading, 0], found[:, :, heading, 1]
        after = found[:, :, heading + 1, :2]
        # the agent turns clockwise, so the sound turns anticlockwise
        assert torch.allclose(after, torch.stack((-front, right), -1), atol=1e-6)
    cell, source = 5, 1
    centres = np.asarray(scene.grid.centres)
    paths = find_paths(
        "diffraction",
        walls(scene.plan),
        np.array([*centres[scene.sources[source]], ROUND.source_height]),
        np.array([[*centres[cell], ROUND.receiver_height]]),
    )
    plan = paths.arrival[0, :2] / np.linalg.norm(paths.arrival[0, :2])
    assert np.allclose(found[source, cell, 0, :2], plan, atol=1e-5)
