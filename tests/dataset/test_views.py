"""Files of views: the same bytes however they come about, and one line where they are not right."""

import numpy as np
import pytest

from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.core.errors import UserError
from avn.dataset.build_views import ViewsFile
from avn.dataset.build_views import build_views as build
from avn.dataset.views import read_views
from avn.views.raycast import Raycast
from avn.views.settings import CameraConfig, LightConfig, RaycastConfig

CFG = RaycastConfig(
    camera=CameraConfig(size=16),
    light=LightConfig(spacing=0.3, shadow_rays=2, gather_rays=8, bounces=2),
)


@pytest.fixture(scope="module")
def plan():
    return generate(3, "flat", sources=3, size="small")


def build_views(plan, folder, part="train", cfg=CFG, processes=1, appearance_seed=0):
    """Make the views of an apartment in a folder; gives their file."""
    path = folder / f"views-{part}-{appearance_seed}.h5"
    build([ViewsFile(plan, part, appearance_seed, path, "a fingerprint")], cfg, processes)
    return path


@pytest.fixture(scope="module")
def states(plan):
    return 4 * build_grid(plan).cells


@pytest.fixture(scope="module")
def made(plan, tmp_path_factory):
    return build_views(plan, tmp_path_factory.mktemp("views"))


def test_views_are_what_the_renderer_makes(plan, made, states):
    views = read_views(made, states, "a fingerprint")
    chosen = np.array([0, 5, states - 1])
    centres = build_grid(plan).centres[chosen // 4]
    rgb, depth = Raycast(CFG, plan, "train").views(centres, chosen % 4)
    assert views.rgb.shape == (states, 16, 16, 3)
    np.testing.assert_array_equal(views.rgb[chosen], rgb)
    np.testing.assert_array_equal(views.depth[chosen], depth)


def test_two_processes_give_the_same_bytes(plan, made, tmp_path):
    assert build_views(plan, tmp_path, processes=2).read_bytes() == made.read_bytes()


def test_a_killed_run_goes_on_where_it_was(plan, made, states, tmp_path, monkeypatch):
    rendered = []
    render = Raycast.views

    def killed_at_the_third(self, centres, headings):
        rendered.append(len(centres))
        if len(rendered) == 3:
            raise KeyboardInterrupt
        return render(self, centres, headings)

    monkeypatch.setattr(Raycast, "views", killed_at_the_third)
    with pytest.raises(KeyboardInterrupt):
        build_views(plan, tmp_path)
    assert not list(tmp_path.glob("*.h5"))
    monkeypatch.setattr("avn.views.raycast.bake", None)  # the light is there
    path = build_views(plan, tmp_path)
    assert sum(rendered) == states + rendered[2]  # only the killed one twice
    assert path.read_bytes() == made.read_bytes()
    assert list(tmp_path.iterdir()) == [path]


def test_views_are_written_before_the_next_apartment_is_begun(plan, made, tmp_path, monkeypatch):
    files = [ViewsFile(plan, "train", 0, tmp_path / f"{n}.h5", "a fingerprint") for n in "ab"]
    render, chunks = Raycast.views, -(-4 * build_grid(plan).cells // 40)
    rendered = []

    def killed_in_the_second(self, centres, headings):
        rendered.append(len(centres))
        if len(rendered) == chunks + 2:
            raise KeyboardInterrupt
        return render(self, centres, headings)

    monkeypatch.setattr(Raycast, "views", killed_in_the_second)
    with pytest.raises(KeyboardInterrupt):
        build(files, CFG, 1)
    assert [file.path.exists() for file in files] == [True, False]
    build(files[1:], CFG, 1)
    assert files[0].path.read_bytes() == files[1].path.read_bytes() == made.read_bytes()


def test_another_appearance_seed_gives_other_views(plan, made, states, tmp_path):
    other = read_views(build_views(plan, tmp_path, appearance_seed=2), states)
    assert np.abs(other.rgb.astype(int) - read_views(made, states).rgb).mean() > 5


def test_missing_views_are_told_in_one_line(states, tmp_path):
    with pytest.raises(UserError, match=r"views-cycles\.h5: no such scene file") as told:
        read_views(tmp_path / "views-cycles.h5", states)
    assert "\n" not in str(told.value)


def test_views_made_from_something_else_are_refused(made, states):
    with pytest.raises(UserError, match="other settings"):
        read_views(made, states, "another fingerprint")
    with pytest.raises(UserError, match=r"'rgb' is .*, not"):
        read_views(made, states + 4)


def test_a_damaged_file_is_refused(made, states, tmp_path):
    path = tmp_path / made.name
    content = bytearray(made.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(UserError, match="changed since it was written"):
        read_views(path, states)
    path.write_bytes(content[:5000])
    with pytest.raises(UserError, match="cut short"):
        read_views(path, states)


def test_a_renderer_that_is_not_there_is_told_in_one_line(plan, tmp_path):
    cfg = RaycastConfig(_target_="avn.views.nothing.Nothing", name="nothing")
    with pytest.raises(UserError, match=r"renderer\._target_"):
        build_views(plan, tmp_path, cfg=cfg)


@pytest.mark.parametrize(
    ("key", "cfg"),
    [
        ("camera.size", RaycastConfig(camera=CameraConfig(size=0))),
        ("camera.height", RaycastConfig(camera=CameraConfig(height=3.0))),
        ("samples", RaycastConfig(samples=0)),
        ("light.spacing", RaycastConfig(light=LightConfig(spacing=0.0))),
    ],
)
def test_settings_that_make_no_sense_are_refused(plan, tmp_path, key, cfg):
    with pytest.raises(UserError, match=rf"renderer\.{key}: .*; give"):
        build_views(plan, tmp_path, cfg=cfg)
