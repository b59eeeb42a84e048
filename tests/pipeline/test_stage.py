"""Stages: what follows from their declaration."""

import multiprocessing
import time
from pathlib import Path

import numpy as np
import pytest
from omegaconf import OmegaConf

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.core.hashing import digest
from avn.pipeline.building import build, missing
from avn.pipeline.stage import Stage

CONFIG = {
    "outputs": "",
    "processes": 1,
    "auto": True,
    "force": False,
    "numerics": "native",
    "rate": 3,
    "ore": {"kind": "iron", "tons": 5, "label": "a"},
    "furnace": {"heat": "${rate}", "colour": "red"},
    "unread": 1,
}


class File(Stage):
    """A stage that leaves a file with what it needed."""

    made: list[str] = []  # noqa: RUF012

    @property
    def title(self):
        return self.kind

    @property
    def folder(self):
        return Path(self.cfg.outputs) / f"{self.kind}-{self.fingerprint[:8]}"

    def done(self):
        return self.folder.is_dir()

    def make(self):
        for need in self.needs():
            assert need.done()
        self.folder.mkdir(parents=True)
        self.made.append(self.kind)


class Ore(File):
    kind = "ore"

    def settings(self):
        return ("ore",)

    def ignored(self):
        return ("ore.label",)

    def check(self):
        if self.cfg.ore.tons < 0:
            raise UserError("ore.tons: less than none")


class Slag(File):
    kind = "slag"

    def needs(self):
        return (Ore(self.cfg),)


class Steel(File):
    kind = "steel"

    def needs(self):
        return (Ore(self.cfg),)

    def settings(self):
        return ("furnace.heat",)

    def by_products(self):
        return (Slag(self.cfg),)

    def make(self):
        super().make()
        Slag(self.cfg).folder.mkdir(exist_ok=True)


class Bridge(File):
    kind = "bridge"

    def needs(self):
        return (Slag(self.cfg), Steel(self.cfg))

    def consulted(self):
        return ("furnace.colour",)


@pytest.fixture
def config(tmp_path):
    File.made.clear()

    def changed(**values):
        cfg = OmegaConf.create({**CONFIG, "outputs": str(tmp_path / "out")})
        for key, value in values.items():
            OmegaConf.update(cfg, key.replace("__", "."), value)
        return cfg

    return changed


def titles(stages):
    return [stage.title for stage in stages]


def test_a_hash_is_of_the_values_and_not_of_their_order():
    config = OmegaConf.create({"a": 1, "b": {"c": "${a}"}})
    assert digest({"x": 1, "y": 2}) == digest({"y": 2, "x": 1})
    assert digest(config) == digest({"b": {"c": 1}, "a": 1})
    assert digest({"x": 1}) != digest({"x": 2})
    assert digest(np.arange(3)) != digest(np.arange(3.0))


@pytest.mark.parametrize(
    ("key", "value", "moves"),
    [
        ("ore__kind", "tin", {"ore", "slag", "steel", "bridge"}),
        ("ore__label", "b", set()),
        ("rate", 4, {"steel", "bridge"}),
        ("furnace__colour", "blue", set()),
        ("unread", 2, set()),
        ("processes", 2, set()),
    ],
)
def test_a_setting_enters_the_fingerprints_of_what_reads_it(config, key, value, moves):
    kinds = {"ore": Ore, "slag": Slag, "steel": Steel, "bridge": Bridge}
    before, after = (
        {name: kind(cfg).fingerprint for name, kind in kinds.items()}
        for cfg in (config(), config(**{key: value}))
    )
    assert {name for name in kinds if before[name] != after[name]} == moves


def test_a_raised_version_makes_anew_what_depends_on_it(config, monkeypatch):
    ore, steel, bridge = (kind(config()).fingerprint for kind in (Ore, Steel, Bridge))
    monkeypatch.setattr(Steel, "version", 2)
    assert Ore(config()).fingerprint == ore
    assert Steel(config()).fingerprint != steel
    assert Bridge(config()).fingerprint != bridge


def test_what_is_read_is_read_by_needs_and_through_references(config):
    machine = {"outputs", "processes", "auto", "force", "numerics"}
    assert Ore(config()).read() == machine | {"ore.kind", "ore.tons"}
    assert Bridge(config()).read() == machine | {
        "ore.kind",
        "ore.tons",
        "furnace.heat",
        "rate",
        "furnace.colour",
    }


def test_a_plan_is_in_order_names_each_once_and_writes_nothing(config, tmp_path):
    cfg = config()
    # steel makes slag along the way, so that it comes first and slag does not come at all
    assert titles(missing([Bridge(cfg)])) == ["ore", "steel", "bridge"]
    assert titles(missing([Slag(cfg), Bridge(cfg)])) == ["ore", "steel", "bridge"]
    assert titles(missing([Slag(cfg)])) == ["ore", "slag"]
    assert list(tmp_path.iterdir()) == []


def test_what_is_below_a_stage_that_is_there_is_not_looked_at(config):
    cfg = config()
    for kind in (Steel, Slag):
        kind(cfg).folder.mkdir(parents=True)
    assert titles(missing([Bridge(cfg)])) == ["bridge"]


def test_each_is_made_once_and_then_nothing_is_missing(config):
    build(Bridge(config()))
    assert File.made == ["ore", "steel", "bridge"]
    build(Bridge(config()))
    build(Bridge(config(rate=9)))
    assert File.made == ["ore", "steel", "bridge", "steel", "bridge"]
    assert missing([Bridge(config())]) == []


def test_settings_that_cannot_work_are_refused_before_anything_is_made(config, tmp_path):
    with pytest.raises(UserError, match=r"ore\.tons: less than none"):
        build(Bridge(config(ore__tons=-1)))
    assert list(tmp_path.iterdir()) == []


def test_auto_false_makes_what_was_asked_for_and_nothing_else(config):
    cfg = config(auto=False)
    with pytest.raises(UserError, match=r"ore is missing and auto=false"):
        build(Steel(cfg), explicit=True)
    with pytest.raises(UserError, match=r"ore is missing and auto=false"):
        build(Ore(cfg))
    build(Ore(cfg), explicit=True)
    build(Steel(cfg), explicit=True)
    assert File.made == ["ore", "steel"]


def test_a_file_is_there_whole_or_not_at_all(tmp_path):
    path = tmp_path / "file"

    def break_off():
        with atomic_write(path) as part:
            part.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        break_off()
    assert list(tmp_path.iterdir()) == []
    with atomic_write(path) as part:
        part.write_text("whole")
    assert path.read_text() == "whole"


class Slow(File):
    kind = "slow"

    def make(self):
        with (Path(self.cfg.outputs) / "made").open("a") as log:
            log.write("once\n")
        time.sleep(0.5)
        self.folder.mkdir()


def test_two_at_once_make_it_once(config):
    cfg = config()
    context = multiprocessing.get_context("fork")
    both = [context.Process(target=build, args=(Slow(cfg),)) for _ in range(2)]
    for process in both:
        process.start()
    for process in both:
        process.join()
    assert [process.exitcode for process in both] == [0, 0]
    assert (Path(cfg.outputs) / "made").read_text() == "once\n"
