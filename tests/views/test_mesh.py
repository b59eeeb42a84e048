import numpy as np
import pytest

from avn.views.light_points import normals_of
from avn.views.mesh import boxes, join, split, take


@pytest.fixture
def two():
    lower, upper = np.array([(0, 0, 0), (2.0, 0, 0)]), np.array([(1, 0.5, 2), (3, 1, 0.1)])
    return boxes(lower, upper, np.array([(1, 0, 0), (0, 1, 0)]), np.array([4, 7]))


def test_faces_of_a_box_look_outward(two):
    normal, area = normals_of(two.vertices)
    for index, piece in enumerate((4, 7)):
        own = two.piece == piece
        middle = two.vertices[own].reshape(-1, 3).mean(axis=0)
        outward = ((two.vertices[own].mean(axis=1) - middle) * normal[own]).sum(axis=1)
        assert (outward > 0).all()
        assert area[own].sum() == pytest.approx((7.0, 2.4)[index])


def test_split_keeps_the_surface_and_shortens_the_edges(two):
    fine, parent = split(two, 0.3)
    edges = np.linalg.norm(np.roll(fine.vertices, -1, axis=1) - fine.vertices, axis=2)
    assert edges.max() <= 0.3
    np.testing.assert_array_equal(fine.piece, two.piece[parent])
    np.testing.assert_allclose(normals_of(fine.vertices)[0], normals_of(two.vertices)[0][parent])
    area = np.bincount(parent, normals_of(fine.vertices)[1])
    np.testing.assert_allclose(area, normals_of(two.vertices)[1], rtol=1e-4)


def test_textures_are_renumbered_when_meshes_are_joined(two):
    picture = np.zeros((2, 2, 3), np.uint8)
    first = take(two, np.arange(2))
    textured = type(first)(
        first.vertices, first.uv, np.array([0, -1], np.int32), first.colour, (picture,), first.piece
    )
    joined = join((textured, textured))
    assert joined.texture.tolist() == [0, -1, 1, -1]
    assert len(joined.textures) == 2
