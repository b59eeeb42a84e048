"""Files of views: the same bytes however they come about, and one line where they are not right."""

import numpy as np
import pytest

from avn.acoustics.brir import AcousticsConfig
from avn.apartments.generator import generate
from avn.core.errors import UserError
from avn.dataset import build, build_views
from avn.dataset.views import views_file
from avn.views.camera import CameraConfig
from avn.views.lighting import LightConfig
from avn.views.raycast import Raycast, RaycastConfig

CFG = RaycastConfig(
    camera=CameraConfig(size=16),
    light=LightConfig(spacing=0.3, shadow_rays=2, gather_rays=8, bounces=2),
)


@pytest.fixture(scope="module")
def plan():
    return generate(3, "flat", sources=3, size="small")


def opened(plan, folder):
    return build.build_geometry(plan, AcousticsConfig(), folder / plan.name)


@pytest.fixture(scope="module")
def made(plan, tmp_path_factory):
    scene = opened(plan, tmp_path_factory.mktemp("views"))
    build_views.build_views([(scene, "train")], CFG, processes=1)
    return scene


def test_views_are_what_the_renderer_makes(plan, made):
    views = made.views("raycast", build_views.views_hash(plan, "train", CFG))
    states = np.array([0, 5, 4 * made.grid.cells - 1])
    rgb, depth = Raycast(CFG, plan, "train").views(made.grid.centres[states // 4], states % 4)
    assert views.rgb.shape == (4 * made.grid.cells, 16, 16, 3)
    np.testing.assert_array_equal(views.rgb[states], rgb)
    np.testing.assert_array_equal(views.depth[states], depth)


def test_two_processes_give_the_same_bytes(plan, made, tmp_path):
    again = opened(plan, tmp_path)
    build_views.build_views([(again, "train")], CFG, processes=2)
    found, wanted = (views_file(s.folder, "raycast").read_bytes() for s in (again, made))
    assert found == wanted


def test_a_killed_run_goes_on_where_it_was(plan, made, tmp_path, monkeypatch):
    scene = opened(plan, tmp_path)
    rendered = []
    render = Raycast.views

    def killed_at_the_third(self, centres, headings):
        rendered.append(len(centres))
        if len(rendered) == 3:
            raise KeyboardInterrupt
        return render(self, centres, headings)

    monkeypatch.setattr(Raycast, "views", killed_at_the_third)
    with pytest.raises(KeyboardInterrupt):
        build_views.build_views([(scene, "train")], CFG, processes=1)
    assert not views_file(scene.folder, "raycast").exists()
    assert not build_views.views_made([(scene, "train")], CFG)
    monkeypatch.setattr("avn.views.raycast.bake", None)  # the light is there
    build_views.build_views([(scene, "train")], CFG, processes=1)
    assert sum(rendered) == 4 * scene.grid.cells + rendered[2]  # only the killed one twice
    found, wanted = (views_file(s.folder, "raycast").read_bytes() for s in (scene, made))
    assert found == wanted
    assert not [path for path in scene.folder.iterdir() if path.name.startswith(".")]


def test_looks_lie_in_files_of_their_own(plan, made):
    build_views.build_views([(made, "train")], CFG, processes=1, looks=(0, 2))
    other = made.views("raycast", build_views.views_hash(plan, "train", CFG, 2), look=2)
    assert np.abs(other.rgb.astype(int) - made.views("raycast").rgb).mean() > 5


def test_missing_views_are_told_in_one_line(plan, made, tmp_path):
    with pytest.raises(UserError, match=r"views-cycles\.h5: no such scene file") as told:
        made.views("cycles")
    assert "\n" not in str(told.value)


def test_views_made_from_something_else_are_refused(plan, made):
    assert build_views.views_made([(made, "train")], CFG)
    for part, cfg in (
        ("test", CFG),
        ("train", RaycastConfig(camera=CameraConfig(size=24), light=CFG.light)),
    ):
        with pytest.raises(UserError, match="other settings"):
            build_views.build_views([(made, part)], cfg, processes=1)
        with pytest.raises(UserError, match="other settings"):
            made.views("raycast", build_views.views_hash(plan, part, cfg))


def test_a_damaged_file_is_refused(plan, made, tmp_path):
    scene = opened(plan, tmp_path)
    path = views_file(scene.folder, "raycast")
    content = bytearray(views_file(made.folder, "raycast").read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(UserError, match="changed since it was written"):
        scene.views("raycast")
    path.write_bytes(content[:5000])
    with pytest.raises(UserError, match="cut short"):
        scene.views("raycast")


def test_a_renderer_that_is_not_there_is_told_in_one_line(made):
    cfg = RaycastConfig(_target_="avn.views.nothing.Nothing", name="nothing")
    with pytest.raises(UserError, match=r"renderer\._target_"):
        build_views.build_views([(made, "train")], cfg, processes=1)


@pytest.mark.parametrize(
    ("key", "cfg"),
    [
        ("camera.size", RaycastConfig(camera=CameraConfig(size=0))),
        ("camera.height", RaycastConfig(camera=CameraConfig(height=3.0))),
        ("samples", RaycastConfig(samples=0)),
        ("light.spacing", RaycastConfig(light=LightConfig(spacing=0.0))),
    ],
)
def test_settings_that_make_no_sense_are_refused(made, key, cfg):
    with pytest.raises(UserError, match=rf"renderer\.{key}: .*; give"):
        build_views.build_views([(made, "train")], cfg, processes=1)
