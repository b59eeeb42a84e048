"""Views of a bare room against arithmetic, and what they must be in a furnished one."""

import numpy as np
import pytest

from avn.apartments.floor_plan import CEILING, FloorPlan, Lamp, Room, Window
from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.views.camera import ray_directions
from avn.views.raycast import Raycast
from avn.views.rays import Triangles
from avn.views.settings import CameraConfig, LightConfig, RaycastConfig

ROUGH = LightConfig(spacing=0.25, shadow_rays=2, gather_rays=8, bounces=2)


def small(size=24, **camera):
    return RaycastConfig(camera=CameraConfig(size=size, **camera), light=ROUGH)


@pytest.fixture(scope="module")
def bare():
    room = Room("bedroom", 0.0, 0.0, 4.0, 3.0, "parquet", "plaster", "ceiling_plaster")
    window = Window(2.0, 3.0, "x", 1.2, 0.9, 1.3)
    return FloorPlan("bare", (room,), (), (window,), (), (Lamp(2.0, 1.5, 2.35),))


@pytest.fixture(scope="module")
def flat():
    return generate(3, "flat", sources=3, size="small")


@pytest.mark.parametrize("heading", range(4))
def test_depth_of_a_bare_room_is_the_distance_along_the_axis(bare, heading, monkeypatch):
    monkeypatch.setattr("avn.views.building.wall_pictures", lambda *_: ())
    camera = small(32)
    place = np.array((1.5, 1.0))
    _, depth = Raycast(camera, bare, "train").views(place[None], np.array([heading]))
    rays = ray_directions(camera.camera, heading, 32)[:, :, 0]
    origin = np.array((*place, camera.camera.height))
    low, high = np.array((0.05, 0.05, 0.0)), np.array((3.95, 2.95, CEILING))
    with np.errstate(divide="ignore"):
        walls = np.maximum((low - origin) / rays, (high - origin) / rays)
    axis = ray_directions(camera.camera, heading, 1)[0, 0, 0]
    expected = walls.min(axis=-1) * (rays @ axis)
    assert depth.dtype == np.float16
    np.testing.assert_allclose(depth[0], expected, rtol=2e-3)


def test_lamps_are_visible_and_bright(bare):
    cfg = small(32, pitch=20.0)
    rgb, depth = Raycast(cfg, bare, "train").views(np.array([(2.0, 0.3)]), np.array([0]))
    near = depth[0] < 1.35
    assert near.any()
    assert rgb[0][near].mean() > 200


def test_every_pixel_of_every_state_shows_something(flat):
    grid = build_grid(flat)
    states = np.arange(0, 4 * grid.cells, 3)
    rgb, depth = Raycast(small(16), flat, "validation").views(grid.centres[states // 4], states % 4)
    assert (depth > 0.04).all()
    assert depth.max() < 20
    assert 60 < rgb.mean() < 200
    assert rgb.reshape(len(rgb), -1).max(axis=1).min() > 60  # no view is black
    assert (rgb.max(axis=-1) == 0).mean() < 1e-3


def test_what_was_prepared_gives_the_same_bytes(flat):
    centres, headings = build_grid(flat).centres[:3], np.array([0, 1, 2])
    first = Raycast(small(), flat, "train")
    again = Raycast(small(), flat, "train", prepared=first.prepare())
    other = Raycast(small(), flat, "train")
    for made in (again, other):
        for a, b in zip(first.views(centres, headings), made.views(centres, headings), strict=True):
            assert a.tobytes() == b.tobytes()


def test_views_differ_by_appearance_seed_and_part(flat):
    centres, headings = build_grid(flat).centres[:4], np.arange(4)
    made = [
        Raycast(small(), flat, part, appearance_seed).views(centres, headings)
        for part, appearance_seed in (("train", 0), ("train", 1), ("test", 0))
    ]
    for other in made[1:]:
        assert np.abs(made[0][0].astype(int) - other[0]).mean() > 8
        walls = np.isclose(made[0][1].astype(float), other[1], rtol=1e-2)
        assert walls.mean() > 0.5  # the building stands where it stood


def test_samples_of_a_pixel_smooth_its_edges(flat):
    """Four samples a pixel are nearer to sixteen than one is."""
    centres, headings = build_grid(flat).centres[:4], np.arange(4)
    light = Raycast(small(), flat, "train").prepare()
    pictures = []
    for samples in (1, 2, 4):
        cfg = small()
        cfg.samples = samples
        renderer = Raycast(cfg, flat, "train", prepared=light)
        pictures.append(renderer.views(centres, headings)[0].astype(int))
    error = [np.abs(picture - pictures[2]).mean() for picture in pictures[:2]]
    assert error[1] < 0.6 * error[0]


def test_rays_find_the_furniture_where_grid_and_acoustics_have_it():
    """Straight down and straight from the side, over the box of each piece."""
    plan = generate(11, "home", sources=3, size="mixed")
    renderer = Raycast(small(), plan, "train")
    own = renderer.mesh.piece >= 0
    pieces = renderer.mesh.piece[own]
    triangles = Triangles(renderer.mesh.vertices[own])
    for index, piece in enumerate(plan.furniture):
        x0, y0, x1, y1 = piece.bounds
        corners = renderer.mesh.vertices[renderer.mesh.piece == index].reshape(-1, 3)
        assert (corners >= np.array((x0, y0, piece.z)) - 2e-3).all(), piece.kind
        assert (corners <= np.array((x1, y1, piece.z + piece.height)) + 2e-3).all(), piece.kind
        at = (np.arange(20) + 0.5) / 20
        u, v = (grid.ravel() for grid in np.meshgrid(at, at))
        top = np.full_like(u, piece.z + piece.height + 0.01)
        origins = np.stack((x0 + u * (x1 - x0), y0 + v * (y1 - y0), top), axis=1)
        down = np.tile(np.array((0, 0, -1), np.float32), (len(u), 1))
        hits = triangles.intersect(origins.astype(np.float32), down)
        found = (hits.triangle >= 0) & (hits.distance < piece.height + 0.02)
        found &= pieces[np.maximum(hits.triangle, 0)] == index
        assert found.mean() >= 0.8, piece.kind
