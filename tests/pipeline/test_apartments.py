"""Apartments of the parts of a split, and the scenes that their stages make."""

import json
import shutil

import pytest
import torch
from small import composed

from avn.apartments.splits import FROZEN
from avn.core.errors import UserError
from avn.pipeline.apartments import (
    TEST,
    TRAINING,
    Apartments,
    apartments_of_all_subsets,
    plan_hash,
)
from avn.pipeline.building import build, missing
from avn.pipeline.export import stages_of
from avn.pipeline.occupancy import OccupancyNetwork
from avn.pipeline.scenes import DirectSound, Geometry, LateReverberation
from avn.pipeline.views import RenderedViews

FEW = ("split=mini", "acoustics.rays=300", "acoustics.seconds=0.2", "processes=1")


def test_a_part_without_apartments_is_named_where_it_is_needed(tmp_path):
    folder = shutil.copytree(FROZEN / "var", tmp_path / "plans")
    for path in folder.glob("train_*.json"):
        path.unlink()
    cfg = composed(f"split.folder={folder}", "split.name=own")
    assert len(Apartments(cfg, "test").plans) == 5
    assert [own.subset for own in apartments_of_all_subsets(cfg)] == ["validation", "test"]
    with pytest.raises(UserError, match=r"split\.train is empty: no floor plan of that subset in"):
        Apartments(cfg, "train").plans  # noqa: B018
    with pytest.raises(UserError, match=r"training\.scenes\.train is empty.*training\.scenes=var"):
        Apartments(cfg, "train", TRAINING).plans  # noqa: B018


def test_networks_of_some_rows_train_on_generated_apartments_too():
    one = Apartments(composed("split=mini", "training.generated=1"), "train", TRAINING)
    assert [plan.name for plan in one.plans] == ["train_1", "train_1"]
    assert len(set(map(plan_hash, one.plans))) == 2
    assert "training.generated" in one.keys
    # neither the validation apartments nor the test world has them
    for subset, world in (("validation", TRAINING), ("train", TEST)):
        assert len(Apartments(one.cfg, subset, world).plans) == 1
    counts = {
        "agent=belief": 8,
        "agent=plan_noexp": 0,
        "agent=belief split=mini": 0,
        "agent=belief split=procedural": 0,
        "agent=belief training.generated=3": 3,
    }
    for given, count in counts.items():
        assert composed(*given.split()).training.generated == count


def test_networks_of_other_training_apartments_are_other_networks():
    base, more = ("split=mini", "occupancy_model=small"), "training.generated=1"
    alone, both = (OccupancyNetwork(composed(*own)) for own in (base, (*base, more)))
    assert alone.fingerprint != both.fingerprint


def test_views_of_an_apartment_without_light_are_refused(tmp_path):
    data = json.loads((FROZEN / "mini" / "room_1.json").read_text())
    (tmp_path / "room_1.json").write_text(json.dumps({**data, "lamps": [], "windows": []}))
    cfg = composed(f"split.folder={tmp_path}", "split.name=dark")
    Geometry(cfg, Apartments(cfg, "test")).check()
    with pytest.raises(UserError, match=r"floor plan room_1: has no lamp and no window"):
        RenderedViews(cfg, Apartments(cfg, "test")).check()


def test_cells_and_pairs_are_those_of_the_scenes(outputs):
    cfg = composed(*FEW, f"outputs={outputs}")
    apartments = Apartments(cfg, "train")
    geometry = Geometry(cfg, apartments)
    build(geometry)
    scenes = geometry.load()
    assert apartments.cells == sum(scene.grid.cells for scene in scenes)
    assert apartments.pairs == sum(scene.grid.cells * len(scene.sources) for scene in scenes)


def test_the_two_worlds_sound_alike_or_not_as_they_are_told(outputs):
    cfg = composed(
        *FEW,
        f"outputs={outputs}",
        "acoustics=diffraction",
        "+acoustics@training.acoustics=resonance",
        "training.acoustics.rays=300",
        "training.acoustics.seconds=0.2",
    )
    test, training = (Apartments(cfg, "validation", world) for world in (TRAINING, TRAINING))
    assert DirectSound(cfg, test).paths == DirectSound(cfg, training).paths
    stages = [DirectSound(cfg, Apartments(cfg, "validation")), DirectSound(cfg, training)]
    for stage in stages:
        build(stage)
    one, other = (stage.load()[0] for stage in stages)
    hidden = (~torch.from_numpy(one.in_sight)).nonzero()[0]
    pair = hidden[:1], 4 * hidden[1:]
    # without a wall between them they are the same, behind one they are not
    assert not torch.equal(one.brirs.gather(*pair), other.brirs.gather(*pair))
    seen = torch.from_numpy(one.in_sight).nonzero()[0]
    pair = seen[:1], 4 * seen[1:]
    assert torch.equal(one.brirs.gather(*pair), other.brirs.gather(*pair))


def test_a_split_of_homes_is_planned_for_the_apartments_that_are_asked_for(tmp_path):
    numbers = ("split.train=1", "split.validation=1", "split.test=1")
    cfg = composed("split=homes", *numbers, f"outputs={tmp_path}", command="generate")
    steps = missing(stages_of(cfg))
    kinds = {Geometry, LateReverberation, DirectSound, RenderedViews}
    assert {type(step) for step in steps} == kinds
    assert len(steps) == 3 * len(kinds)
    for step in steps:
        assert len(step.paths) == 1
        assert step.seconds() < 60
    names = {path.parent.name.split("-")[0] for step in steps for path in step.paths}
    assert names == {"train_1", "val_1", "room_1"}
    assert list(tmp_path.iterdir()) == []


def test_more_homes_are_added_to_those_that_are_there(tmp_path):
    def geometry(test):
        cfg = composed("split=homes", f"split.test={test}", f"outputs={tmp_path}")
        return Geometry(cfg, Apartments(cfg, "test"))

    build(geometry(2))
    made = {path: path.stat().st_mtime_ns for path in geometry(2).paths}
    assert len(made) == len(list(tmp_path.glob("generate/*/geometry-*.h5"))) == 2
    more = geometry(3)
    assert more.missing() == [2]
    build(more)
    assert {path: path.stat().st_mtime_ns for path in geometry(2).paths} == made
    assert geometry(1).done()
