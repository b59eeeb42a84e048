import numpy as np
import pytest

from avn.core.errors import UserError
from avn.views.camera import ray_directions
from avn.views.settings import CameraConfig

FORWARD = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])
RIGHT = np.array([(1, 0), (0, -1), (-1, 0), (0, 1)])


def pixel_of(camera, heading, point):
    """Row and column (in pixels, 0.5 being the middle of the first) by the pinhole formula."""
    front = point[:2] @ FORWARD[heading]
    right = point[:2] @ RIGHT[heading]
    up = point[2] - camera.height
    pitch = np.radians(camera.pitch)
    deep = front * np.cos(pitch) + up * np.sin(pitch)
    high = up * np.cos(pitch) - front * np.sin(pitch)
    scale = camera.size / 2 / np.tan(np.radians(camera.fov / 2))
    return camera.size / 2 - scale * high / deep, camera.size / 2 + scale * right / deep


@pytest.mark.parametrize("heading", range(4))
def test_a_point_lies_on_the_ray_of_its_pixel(heading):
    camera = CameraConfig()
    rays = ray_directions(camera, heading, camera.size)[:, :, 0]
    rng = np.random.default_rng(heading)
    for _ in range(20):
        side = rng.uniform(-0.6, 0.6)
        flat = 2.0 * FORWARD[heading] + side * RIGHT[heading]
        point = np.array((*flat, rng.uniform(0, 1.5)))
        row, column = pixel_of(camera, heading, point)
        ray = rays[int(row), int(column)]
        to = point - (0, 0, camera.height)
        angle = np.degrees(np.arccos(ray @ to / np.linalg.norm(to)))
        assert angle < 0.7  # half the diagonal of a pixel in the middle is 0.63 degrees


@pytest.mark.parametrize("heading", range(4))
def test_the_middle_of_the_picture_is_straight_ahead_and_pitched(heading):
    camera = CameraConfig(pitch=-30.0)
    middle = ray_directions(camera, heading, 1)[0, 0, 0]
    np.testing.assert_allclose(middle[:2], np.cos(np.pi / 6) * FORWARD[heading], atol=1e-12)
    assert middle[2] == pytest.approx(-0.5)


def test_left_is_left_and_up_is_up():
    rays = ray_directions(CameraConfig(), 0, 8)[:, :, 0]
    assert (rays[:, 0, 0] < 0).all()
    assert (rays[:, -1, 0] > 0).all()
    assert (np.diff(rays[:, 3, 2]) < 0).all()


def test_the_next_cells_floor_is_in_the_picture():
    camera = CameraConfig()
    row, column = pixel_of(camera, 0, np.array((0.0, 0.5, 0.0)))
    assert 0 <= row <= camera.size
    assert column == camera.size / 2


def test_samples_are_spread_about_the_middle_of_their_pixel():
    camera = CameraConfig()
    middles = ray_directions(camera, 1, 16)[:, :, 0]
    samples = ray_directions(camera, 1, 16, 2)
    assert samples.shape == (16, 16, 4, 3)
    mean = samples.mean(axis=2)
    mean /= np.linalg.norm(mean, axis=-1, keepdims=True)
    assert (mean * middles).sum(axis=-1).min() > np.cos(np.radians(0.2))
    np.testing.assert_allclose(np.linalg.norm(samples, axis=-1), 1.0)


def test_a_field_of_view_that_cannot_be_is_refused():
    with pytest.raises(UserError, match="fov"):
        ray_directions(CameraConfig(fov=180.0), 0, 8)
