"""Blender's views against those of `renderer=raycast`, where Blender is installed."""

import importlib.util

import numpy as np
import pytest

from avn.apartments.floor_plan import FloorPlan, Lamp, Room, Window
from avn.core.errors import UserError
from avn.views.cycles import Cycles
from avn.views.raycast import Raycast
from avn.views.settings import CameraConfig, CyclesConfig, LightConfig, RaycastConfig

blender = pytest.mark.skipif(
    importlib.util.find_spec("bpy") is None, reason="Blender's module bpy is not installed"
)
ROOM = Room("bedroom", 0.0, 0.0, 4.0, 3.0, "parquet", "plaster", "ceiling_plaster")
CAMERA = CameraConfig(size=16)


def bare(lamps=(), windows=()):
    return FloorPlan("bare", (ROOM,), (), windows, (), lamps)


def test_without_blender_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setattr("avn.views.cycles.importlib.util.find_spec", lambda name: None)
    with pytest.raises(UserError, match=r"renderer=cycles: .*pip install 'avn\[render\]'") as told:
        Cycles(CyclesConfig(), bare(), "train")
    assert "\n" not in str(told.value)


@blender
@pytest.mark.parametrize(
    "plan",
    [bare((Lamp(2.0, 1.5, 2.35),)), bare((), (Window(2.0, 3.0, "x", 1.2, 0.9, 1.3),))],
    ids=["lamp", "window"],
)
def test_both_renderers_find_the_same_light(plan, monkeypatch):
    """A lamp's globe keeps some light off the ceiling's reflection in Blender alone."""
    monkeypatch.setattr("avn.views.building.wall_pictures", lambda *_: ())
    light = LightConfig(spacing=0.15, shadow_rays=32)
    ray = Raycast(RaycastConfig(camera=CAMERA, samples=4, light=light), plan, "train")
    cfg = CyclesConfig(camera=CAMERA, samples=64, bounces=5, denoise=False)
    path = Cycles(cfg, plan, "train", prepared={"exposure": ray.prepare()["exposure"]})
    centre, heading = np.array([(2.0, 0.5)]), np.array([1])
    found, depth = path.views(centre, heading)
    wanted, deep = ray.views(centre, heading)
    np.testing.assert_allclose(depth, deep, atol=5e-3)
    apart = found.astype(int) - wanted
    assert abs(np.median(apart)) < 12
    assert np.abs(apart).mean() < 16


@blender
def test_blender_makes_the_same_bytes_twice():
    made = [
        Cycles(CyclesConfig(camera=CAMERA, samples=4), bare((Lamp(2.0, 1.5, 2.35),)), "test")
        for _ in range(2)
    ]
    pictures = [one.views(np.array([(1.0, 1.0)]), np.array([2]))[0].tobytes() for one in made]
    assert pictures[0] == pictures[1]
