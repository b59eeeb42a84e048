"""docs/apartments.md: its tables hold what the code has, and its example can be built."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import pytest
import torch
from small import SMALL, composed, fitting

from avn.acoustics.materials import absorption
from avn.apartments import floor_plan, furniture
from avn.apartments.floor_plan import FURNITURE_KINDS, MATERIALS, ROOM_KINDS
from avn.apartments.furniture import Model
from avn.apartments.splits import PARTS
from avn.pipeline.apartments import Apartments
from avn.pipeline.building import build, missing
from avn.pipeline.scenes import DirectSound, Geometry
from avn.pipeline.sound_network import SoundNetwork
from avn.pipeline.views import RenderedViews
from avn.views import curtain_model
from avn.views.furniture_models import catalogue
from avn.views.textures import pattern

PAGE = (Path(__file__).parents[2] / "docs" / "apartments.md").read_text()
(EXAMPLE,) = re.findall(r"^```json\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def table(heading: str) -> list[list[str]]:
    """The rows of the table whose first column has a heading, without the header."""
    (rows,) = re.findall(rf"^\| {heading} \|.*\n\| ---.*\n((?:\|.*\n)+)", PAGE, re.MULTILINE)
    return [[cell.strip() for cell in row[1:-1].split("|")] for row in rows.splitlines()]


def first_column(heading: str) -> list[str]:
    return [name for row in table(heading) for name in re.findall(r"`(\w+)`", row[0])]


def test_the_page_lists_exactly_the_kinds_and_materials() -> None:
    assert first_column("kind") == list(FURNITURE_KINDS)
    assert first_column("material") == list(MATERIALS)
    kinds = next(row for row in table("`rooms`") if row[0] == "`kind`")
    assert re.findall(r"`(\w+)`", kinds[1]) == list(ROOM_KINDS)


@pytest.mark.parametrize(
    ("part", "cls"),
    [("rooms", "Room"), ("doorways", "Doorway"), ("windows", "Window"), ("furniture", "Piece"),
     ("lamps", "Lamp")],
)  # fmt: skip
def test_the_page_lists_exactly_the_keys_and_defaults(part: str, cls: str) -> None:
    fields = dataclasses.fields(getattr(floor_plan, cls))
    assert sorted(first_column(f"`{part}`")) == sorted(field.name for field in fields)
    for row in table(f"`{part}`"):
        for name in re.findall(r"`(\w+)`", row[0]):
            (field,) = [field for field in fields if field.name == name]
            default = None if field.default is dataclasses.MISSING else field.default
            assert (float(row[2]) if row[2] else None) == default


def test_the_page_lists_exactly_the_keys_of_a_file() -> None:
    assert sorted(first_column("key")) == sorted(json.loads(EXAMPLE))


def test_the_table_of_materials_has_the_absorption_of_the_acoustics() -> None:
    for row, bands in zip(table("material"), absorption(MATERIALS), strict=True):
        assert [float(cell) for cell in row[1:4]] == [round(bands[i], 2) for i in (0, 3, 5)]


def test_the_table_of_furniture_has_the_catalogue() -> None:
    models = [model for model in vars(furniture).values() if isinstance(model, Model)]
    assert {model.kind for model in models} <= set(FURNITURE_KINDS)
    rows = {row[0].strip("`"): row for row in table("kind")}
    for model in models:
        _, sizes, z, material = rows[model.kind]
        assert material == f"`{model.material}`"
        assert float(z) == model.z
        for size, text in zip(
            (model.width, model.depth, model.height), sizes.split(", "), strict=True
        ):
            low, high = (float(end) for end in (text.split(" to ") * 2)[:2])
            assert low <= size <= high


def test_every_kind_has_a_model_in_each_part_and_every_material_a_pattern() -> None:
    for part in PARTS:
        modelled = {kind for model in catalogue() if model.pool == part for kind in model.kinds}
        assert modelled | {curtain_model.KIND} == set(FURNITURE_KINDS)
        for material in MATERIALS:
            assert pattern(material, part, "home").picture.any()


def write(folder: Path, **names: tuple[float, float]) -> Path:
    """A folder with the example under some names, each with its second source at a place."""
    folder.mkdir()
    for name, source in names.items():
        data = {**json.loads(EXAMPLE), "name": name}
        data["sources"][1] = source
        (folder / f"{name}.json").write_text(json.dumps(data))
    return folder


def test_the_example_is_walked_with_the_command_of_the_page(command, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_apartments").mkdir()
    (tmp_path / "my_apartments" / "home.json").write_text(EXAMPLE)
    line = "python -m avn.eval agent=random_walk split.folder=my_apartments split.name=mine"
    assert line in PAGE
    code, out, err = command("eval", *line.split()[3:], "protocol.num_starts=4")
    assert code == 0, err
    assert Path(out[-1], "episodes.csv").is_file()


def test_apartments_that_stay_are_not_built_again_in_another_split(tmp_path) -> None:
    """Neither their sound nor their views, nor a network that is trained in them."""
    places = {"train_a": (5.0, 1.0), "val_b": (4.0, 1.0)}
    splits = {
        "first": write(tmp_path / "first", **places, home=(5.0, 1.0)),
        "renamed": write(tmp_path / "renamed", **places, flat=(4.0, 1.5)),
    }
    coarse = ("acoustics.rays=100", "renderer.light.spacing=0.6")
    settings = (*fitting("generate", *SMALL[1:]), *coarse)

    def stages(name: str) -> list:
        cfg = composed(
            *settings,
            f"split.folder={splits[name]}",
            f"split.name={name}",
            f"outputs={tmp_path / 'outputs'}",
            command="generate",
        )
        return [
            stage(cfg, Apartments(cfg, part))
            for part in ("train", "test")
            for stage in (DirectSound, RenderedViews)
        ]

    first, renamed = stages("first"), stages("renamed")
    for stage in first[:2]:
        build(stage)
    assert [stage.title for stage in missing(renamed[:2])] == []
    assert {type(stage) for stage in missing(renamed[2:])} > {Geometry, DirectSound, RenderedViews}
    shared = set(first[2].paths + first[3].paths) & set(renamed[2].paths + renamed[3].paths)
    assert not shared
    (scene,), (views,) = (stage.load() for stage in renamed[:2])
    assert scene.name == "train_a"
    heard = scene.brirs.gather(torch.tensor([0]), torch.tensor([0]))
    assert heard.abs().max() > 0
    assert views.rgb.std() > 10
    networks = [
        SoundNetwork(composed("agent=greedy", f"split.folder={folder}", f"split.name={name}"))
        for name, folder in splits.items()
    ]
    assert networks[0].fingerprint == networks[1].fingerprint
