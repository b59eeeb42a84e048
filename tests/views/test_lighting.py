"""Baked light against closed forms."""

import numpy as np
import pytest

from avn.views import lighting
from avn.views.light_points import choose_points, normals_of
from avn.views.lighting import bake
from avn.views.lights import Lamps, Panes
from avn.views.mesh import Mesh, boxes, join, split
from avn.views.settings import LightConfig

NO_PANES = Panes(*(np.zeros((0, 3)) for _ in range(5)))


def no_lamps():
    return Lamps(np.zeros((0, 3)), 0.1, np.zeros((0, 3)))


def lamp(centre, intensity, radius=0.05):
    return Lamps(np.array([centre], float), radius, np.full((1, 3), intensity))


def room(size, spacing):
    """The inner faces of a box from the origin, as a building's."""
    building = boxes(np.zeros((1, 3)), np.array([size], float), np.ones((1, 3)), np.array([-1]))
    inside = Mesh(
        np.ascontiguousarray(building.vertices[:, ::-1]),
        building.uv,
        building.texture,
        building.colour,
        (),
        building.piece,
    )
    return split(inside, spacing * 1.42)[0]


def floor(half, spacing):
    corners = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)])
    vertices = corners[np.array([[0, 1, 2], [0, 2, 3]])].astype(np.float32)
    two = np.full(2, -1, np.int32)
    zeros = np.zeros((2, 3, 2), np.float32)
    return split(Mesh(vertices, zeros, two, np.ones((2, 3), np.float32), (), two), spacing)[0]


def baked(mesh, albedo, lamps, panes, cfg):
    points = choose_points(mesh, cfg.spacing)
    colour = np.full((len(mesh), 3), albedo, np.float32)
    occluder = np.ones(len(mesh), bool)
    return bake(mesh, colour, occluder, lamps, panes, cfg, points), points


def test_light_of_a_lamp_falls_with_the_cosine_and_the_square_of_the_distance():
    cfg = LightConfig(spacing=0.05, shadow_rays=16, gather_rays=1, bounces=0)
    mesh = floor(2.0, 0.05)
    light, points = baked(mesh, 0.5, lamp((0, 0, 1.5), 3.0), NO_PANES, cfg)
    place = np.empty((points.corner.max() + 1, 3))
    place[points.corner.ravel()] = mesh.vertices.reshape(-1, 3)
    square = (place[:, :2] ** 2).sum(axis=1) + 1.5**2
    expected = 3.0 * 1.5 / square**1.5
    inner = np.abs(place[:, :2]).max(axis=1) < 1.9  # corners at the rim have one-sided means
    np.testing.assert_allclose(light[0, inner, 0], expected[inner], rtol=0.03)


def test_light_of_a_window_is_the_integral_over_its_pane():
    panes = Panes(
        np.array([(-0.5, -0.3, 2.0)]),
        np.array([(1.0, 0, 0)]),
        np.array([(0, 0.6, 0)]),
        np.array([(0, 0, -1.0)]),
        np.array([(2.0, 2.0, 2.0)]),
    )
    cfg = LightConfig(spacing=0.1, shadow_rays=64, gather_rays=1, bounces=0)
    mesh = floor(0.3, 0.1)
    light, points = baked(mesh, 0.5, no_lamps(), panes, cfg)
    at = np.unravel_index(np.abs(mesh.vertices).sum(axis=2).argmin(), (*mesh.texture.shape, 3))
    found = light[0, points.corner[at], 0]
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 401), np.linspace(-0.3, 0.3, 401))
    expected = 2.0 * np.mean(4.0 / (x**2 + y**2 + 4.0) ** 2) * 0.6
    assert found == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("albedo", [0.3, 0.8])
def test_a_closed_box_swallows_what_its_lamp_gives(albedo):
    """Sum of (1 - albedo) x irradiance x area is the lamp's flux, 4 pi times its intensity."""
    cfg = LightConfig(spacing=0.15, shadow_rays=16, gather_rays=64, bounces=40)
    mesh = room((3.0, 2.0, 2.5), 0.15)
    light, points = baked(mesh, albedo, lamp((1.2, 0.9, 1.4), 1.0), NO_PANES, cfg)
    _, area = normals_of(mesh.vertices)
    mean = light[0][points.corner].mean(axis=1)[:, 0]
    swallowed = (1 - albedo) * (mean * area).sum()
    assert swallowed == pytest.approx(4 * np.pi, rel=0.04)


def test_no_light_comes_through_a_wall_or_under_it():
    """Two rooms that share a wall of 0.1 m; the lamp stands in the first."""
    cfg = LightConfig(spacing=0.1, shadow_rays=16, gather_rays=64, bounces=4)
    first = room((2.0, 2.0, 2.5), 0.1)
    moved = first.vertices + np.array((2.1, 0, 0), np.float32)
    second = Mesh(moved, first.uv, first.texture, first.colour, (), first.piece)
    mesh = join((first, second))
    light, points = baked(mesh, 0.7, lamp((1.9, 1.0, 2.4), 5.0), NO_PANES, cfg)
    assert light[0][points.corner[len(first) :]].max() == 0.0
    assert light[0][points.corner[: len(first)]].min() > 0.0


def test_a_box_on_the_floor_throws_a_shadow_and_is_lit_on_the_outside():
    cfg = LightConfig(spacing=0.05, shadow_rays=16, gather_rays=32, bounces=2)
    box = boxes(
        np.array([(0.2, -0.2, 0.0)]), np.array([(0.4, 0.2, 0.4)]), np.ones((1, 3)), np.array([0])
    )
    mesh = join((floor(1.5, 0.07), split(box, 0.07)[0]))
    light, points = baked(mesh, 0.5, lamp((-0.6, 0, 1.0), 1.0), NO_PANES, cfg)
    middle = mesh.vertices.mean(axis=1)
    mean = light[:, points.corner].mean(axis=2)[..., 0]
    on_floor = middle[:, 2] < 1e-6
    behind = on_floor & (np.abs(middle[:, 0] - 0.5) < 0.06) & (np.abs(middle[:, 1]) < 0.1)
    before = on_floor & (np.abs(middle[:, 0] - 0.1) < 0.06) & (np.abs(middle[:, 1]) < 0.1)
    assert mean[0, behind].max() < 0.2 * mean[0, before].min()
    top = (mesh.piece == 0) & (middle[:, 2] > 0.3999)
    assert mean[0, top].min() > 0.3
    assert mean[1, top].max() < 0.02  # its inside is dark


def test_the_same_bytes_however_the_work_is_cut(monkeypatch):
    cfg = LightConfig(spacing=0.2, shadow_rays=4, gather_rays=16, bounces=2)
    mesh = room((2.0, 1.5, 2.5), 0.2)
    whole, _ = baked(mesh, 0.6, lamp((1.0, 0.8, 2.0), 2.0), NO_PANES, cfg)
    monkeypatch.setattr(lighting, "_AT_ONCE", 1000)
    parts, _ = baked(mesh, 0.6, lamp((1.0, 0.8, 2.0), 2.0), NO_PANES, cfg)
    assert whole.tobytes() == parts.tobytes()


def test_both_faces_of_a_thin_board_have_points_of_their_own():
    board = boxes(
        np.array([(0.0, 0.0, 0.70)]), np.array([(0.05, 0.05, 0.72)]), np.ones((1, 3)), np.array([3])
    )
    points = choose_points(board, 0.07)
    normal, _ = normals_of(board.vertices)
    top, bottom = points.front[normal[:, 2] > 0.9], points.front[normal[:, 2] < -0.9]
    assert not set(top) & set(bottom)
    assert (points.back >= points.front.max()).all()


def test_a_sheet_close_under_another_does_not_darken_it():
    outer = boxes(np.zeros((1, 3)), np.array([(0.5, 0.5, 0.5)]), np.ones((1, 3)), np.array([0]))
    hidden = boxes(np.full((1, 3), 0.004), np.full((1, 3), 0.496), np.ones((1, 3)), np.array([0]))
    cfg = LightConfig(spacing=0.07, shadow_rays=8, gather_rays=1, bounces=0)
    for pair in ((outer, hidden), (hidden, outer)):
        mesh = split(join(pair), 0.1)[0]
        light, points = baked(mesh, 0.5, lamp((0.25, 0.25, 2.0), 1.0), NO_PANES, cfg)
        top = (mesh.vertices[..., 2] > 0.499).all(axis=1)
        assert light[0][points.corner[top]].min() > 0.2


def test_a_sheet_that_is_a_little_aslant_far_from_the_origin_does_not_darken_another():
    """Heights are compared along one direction: at 9 m a tilt of 0.01 would count for 9 cm."""
    upper, lower = floor(0.3, 0.07), floor(0.3, 0.07)
    upper.vertices[..., 2] = 0.006 + 0.001 * upper.vertices[..., 0]
    mesh = join((lower, upper))
    mesh.vertices[...] += np.array((9.0, 5.0, 0.75), np.float32)
    cfg = LightConfig(spacing=0.07, shadow_rays=4, gather_rays=1, bounces=0)
    light, points = baked(mesh, 0.5, lamp((9.0, 5.0, 2.3), 1.0), NO_PANES, cfg)
    assert light[0][points.corner[len(lower) :]].min() > 0.2
