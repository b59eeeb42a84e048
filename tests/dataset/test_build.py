"""Scene folders of a small apartment: the same bytes however they come about."""

import numpy as np
import pytest
import torch

from avn.acoustics import brir
from avn.acoustics.brir import AcousticsConfig
from avn.apartments.generator import generate
from avn.apartments.surfaces import build_surfaces
from avn.apartments.walls import walls
from avn.core.errors import UserError
from avn.dataset import build, scene

FEW = AcousticsConfig(rays=200, seconds=0.1)
ROUND = AcousticsConfig(name="diffraction", first_arrival="round_corners", rays=200, seconds=0.1)


@pytest.fixture(scope="module")
def plan():
    return generate(3, "flat", sources=3, size="small")


@pytest.fixture(scope="module")
def made(plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / plan.name
    opened = build.build_geometry(plan, FEW, folder)
    build.build_acoustics([opened], FEW, processes=1)
    build.build_acoustics([opened], ROUND, processes=1)
    return opened


def content(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.h5"))}


def test_one_or_two_processes_give_the_same_bytes(plan, made, tmp_path):
    again = build.build_geometry(plan, FEW, tmp_path / plan.name)
    build.build_acoustics([again], FEW, processes=2)
    build.build_acoustics([again], ROUND, processes=2)
    assert content(again.folder) == content(made.folder)


def test_a_killed_run_goes_on_where_it_was(plan, made, tmp_path, monkeypatch):
    opened = build.build_geometry(plan, FEW, tmp_path / plan.name)
    traced = []
    render = brir.render_source

    def killed_at_the_second(*arguments, **named):
        traced.append(1)
        if len(traced) == 2:
            raise KeyboardInterrupt
        return render(*arguments, **named)

    monkeypatch.setattr(brir, "render_source", killed_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        build.build_acoustics([opened], FEW, processes=1)
    assert not scene.tail_file(opened.folder).exists()
    build.build_acoustics([opened], FEW, processes=1)
    assert len(traced) == 2 + 2  # one was there, one was killed, two were left
    name = "acoustics-tail.h5"
    assert content(opened.folder)[name] == content(made.folder)[name]
    assert not [path for path in opened.folder.iterdir() if path.name.startswith(".")]


def test_what_is_gathered_is_what_was_rendered(plan, made):
    brirs = made.brirs("diffraction")
    grid, config = made.grid, ROUND
    ears = np.column_stack([grid.centres, np.full(grid.cells, config.ear_height)])
    source = np.array([*grid.centres[made.sources[1]], config.source_height])
    tail = brir.render_source(build_surfaces(plan), source, ears, config)
    first = brir.render_first_arrivals(walls(plan), source, ears, config)
    whole = brir.combine(tail, first)
    cells = torch.tensor([0, 5, grid.cells - 1])
    for heading in range(4):
        found = brirs.gather(torch.tensor([1, 1, 1]), 4 * cells + heading)
        np.testing.assert_allclose(found.numpy(), whole[cells, heading], atol=1e-7)


def test_the_regimes_share_the_tail_and_differ_in_the_first_arrival(made):
    files = content(made.folder)
    assert set(files) == {
        "geometry.h5",
        "acoustics-tail.h5",
        "acoustics-resonance.h5",
        "acoustics-diffraction.h5",
    }
    assert files["acoustics-resonance.h5"] != files["acoustics-diffraction.h5"]


def test_files_of_another_floor_plan_are_refused(made):
    other = generate(4, "flat", sources=3, size="small")
    with pytest.raises(UserError, match="another floor plan"):
        build.build_geometry(other, FEW, made.folder)


def test_geometry_is_what_the_plan_says(plan, made):
    assert made.plan == plan
    assert made.in_sight[np.arange(3), made.sources].all()
    assert (np.diag(made.grid.distances) == 0).all()
