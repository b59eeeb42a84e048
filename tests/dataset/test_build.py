"""Scene folders of a small apartment: the same bytes however they come about."""

import numpy as np
import pytest
import torch
from small import opened

from avn.acoustics import brir
from avn.acoustics.settings import AcousticsConfig
from avn.apartments.generator import generate
from avn.apartments.surfaces import build_surfaces
from avn.apartments.walls import walls
from avn.core.errors import UserError
from avn.dataset import build
from avn.dataset.scene import Brirs

FEW = AcousticsConfig(rays=200, seconds=0.1)
ROUND = AcousticsConfig(name="diffraction", direct_path="diffraction", rays=200, seconds=0.1)


@pytest.fixture(scope="module")
def plan():
    return generate(3, "flat", sources=3, size="small")


def sounded(plan, folder, processes=1):
    """The apartment in both regimes, made in a folder."""
    scene = opened(plan, FEW, folder)
    reverberation = scene.folder / "tail.h5"
    build.build_reverberation([(scene, reverberation, "t")], FEW, processes)
    regimes = []
    for name, acoustics in (("resonance", FEW), ("diffraction", ROUND)):
        direct_path = scene.folder / f"{name}.h5"
        build.build_direct_sound(scene, acoustics, direct_path, name)
        brirs = Brirs(
            (reverberation, "t"), (direct_path, name), len(scene.sources), scene.grid.cells
        )
        regimes.append(scene.with_brirs(brirs))
    return regimes


@pytest.fixture(scope="module")
def made(plan, tmp_path_factory):
    return sounded(plan, tmp_path_factory.mktemp("made"))


def content(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.h5"))}


def test_one_or_two_processes_give_the_same_bytes(plan, made, tmp_path):
    again = sounded(plan, tmp_path, processes=2)
    assert content(again[0].folder) == content(made[0].folder)


def test_a_killed_run_goes_on_where_it_was(plan, made, tmp_path, monkeypatch):
    scene = opened(plan, FEW, tmp_path)
    file = (scene, scene.folder / "tail.h5", "t")
    traced = []
    render = brir.render_source

    def killed_at_the_second(*arguments, **named):
        traced.append(1)
        if len(traced) == 2:
            raise KeyboardInterrupt
        return render(*arguments, **named)

    monkeypatch.setattr(brir, "render_source", killed_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        build.build_reverberation([file], FEW, processes=1)
    assert not file[1].exists()
    build.build_reverberation([file], FEW, processes=1)
    assert len(traced) == 2 + 2  # one was there, one was killed, two were left
    assert content(scene.folder)["tail.h5"] == content(made[0].folder)["tail.h5"]
    assert not [path for path in scene.folder.iterdir() if path.name.startswith(".")]


def test_an_apartment_is_written_before_the_next_one_is_begun(plan, made, tmp_path, monkeypatch):
    scenes = [opened(plan, FEW, tmp_path / name) for name in ("one", "two")]
    files = [(scene, scene.folder / "tail.h5", "t") for scene in scenes]
    traced, render = [], brir.render_source

    def killed_in_the_second(*arguments, **named):
        traced.append(1)
        if len(traced) == len(plan.sources) + 2:
            raise KeyboardInterrupt
        return render(*arguments, **named)

    monkeypatch.setattr(brir, "render_source", killed_in_the_second)
    with pytest.raises(KeyboardInterrupt):
        build.build_reverberation(files, FEW, processes=1)
    assert [path.exists() for _, path, _ in files] == [True, False]
    build.build_reverberation(files[1:], FEW, processes=1)
    for _, path, _ in files:
        assert path.read_bytes() == content(made[0].folder)["tail.h5"]


def test_what_is_gathered_is_what_was_rendered(plan, made):
    scene = made[1]
    brirs, grid, config = scene.brirs, scene.grid, ROUND
    receivers = np.column_stack([grid.centres, np.full(grid.cells, config.receiver_height)])
    source = np.array([*grid.centres[scene.sources[1]], config.source_height])
    reverberation = brir.render_source(build_surfaces(plan), source, receivers, config)
    direct_path = brir.render_direct_paths(walls(plan), source, receivers, config)
    whole = brir.combine(reverberation, direct_path)
    cells = torch.tensor([0, 5, grid.cells - 1])
    for heading in range(4):
        found = brirs.gather(torch.tensor([1, 1, 1]), 4 * cells + heading)
        np.testing.assert_allclose(found.numpy(), whole[cells, heading], atol=1e-7)


def test_energies_are_those_of_both_parts_of_the_responses(plan, made):
    brirs, grid = made[1].brirs, made[1].grid
    direct, reverberation = brirs.energies()
    receivers = np.column_stack([grid.centres, np.full(grid.cells, ROUND.receiver_height)])
    for source, cell in enumerate(made[1].sources):
        place = np.array([*grid.centres[cell], ROUND.source_height])
        paths = brir.render_direct_paths(walls(plan), place, receivers, ROUND)
        wanted = (paths.samples * paths.scale[:, None, None, None].astype(float)) ** 2
        np.testing.assert_allclose(direct[source], wanted.sum(axis=(1, 2, 3)), rtol=1e-5)
        tail = brir.render_source(build_surfaces(plan), place, receivers, ROUND)
        wanted = (tail.samples * tail.scale[:, None, None, None].astype(float)) ** 2
        np.testing.assert_allclose(reverberation[source], wanted.sum(axis=(1, 2, 3)), rtol=1e-5)


def test_the_regimes_share_the_tail_and_differ_in_the_first_arrival(made):
    one, other = (scene.brirs for scene in made)
    hidden = np.argwhere(~made[0].in_sight)[0]
    seen = np.argwhere(made[0].in_sight)[0]
    for (source, cell), equal in ((seen, True), (hidden, False)):
        pair = torch.tensor([source]), torch.tensor([4 * cell])
        assert torch.equal(one.gather(*pair), other.gather(*pair)) == equal


def test_responses_of_another_making_are_refused(made):
    reverberation, direct_path = (made[0].folder / name for name in ("tail.h5", "resonance.h5"))
    pairs = len(made[0].sources), made[0].grid.cells
    with pytest.raises(UserError, match="another floor plan or other settings"):
        Brirs((reverberation, "another"), (direct_path, "resonance"), *pairs)
    with pytest.raises(UserError, match=r"resonance\.h5: made from another"):
        Brirs((reverberation, "t"), (direct_path, "diffraction"), *pairs)


def test_geometry_is_what_the_plan_says(plan, made):
    scene = made[0]
    assert scene.plan == plan
    assert scene.in_sight[np.arange(3), scene.sources].all()
    assert (np.diag(scene.grid.distances) == 0).all()
