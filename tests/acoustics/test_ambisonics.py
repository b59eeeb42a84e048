"""Spherical harmonics: orthogonality, known values and turning."""

import numpy as np
import pytest

from avn.acoustics.ambisonics import CHANNELS, DEGREES, rotation_to_heading, sh


def sphere(count: int) -> np.ndarray:
    """Directions that cover the sphere evenly (a Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    up = 1 - 2 * index / count
    azimuth = np.pi * (1 + 5**0.5) * index
    flat = np.sqrt(1 - up**2)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), up], axis=-1)


def test_channels_are_orthogonal_with_the_weights_of_sn3d() -> None:
    harmonics = sh(sphere(20_000))
    gram = harmonics.T @ harmonics / len(harmonics)
    orders = np.floor(np.sqrt(np.arange(CHANNELS)))
    np.testing.assert_allclose(gram, np.diag(1 / (2 * orders + 1)), atol=1e-4)


def test_energy_of_every_order_is_the_same_in_all_directions() -> None:
    squares = sh(sphere(100)) ** 2
    for order in range(4):
        np.testing.assert_allclose(squares[:, order**2 : (order + 1) ** 2].sum(axis=1), 1)


@pytest.mark.parametrize(
    ("direction", "channel"), [((-1, 0, 0), 1), ((0, 0, 1), 2), ((0, 1, 0), 3)]
)
def test_first_order_points_west_up_and_north(direction: tuple, channel: int) -> None:
    expected = np.zeros(3)
    expected[channel - 1] = 1
    np.testing.assert_array_equal(sh(direction)[1:4], expected)


def test_channels_of_negative_degree_change_sign_in_a_mirror() -> None:
    directions = sphere(50)
    mirrored = sh(directions * [-1, 1, 1])
    np.testing.assert_allclose(mirrored, sh(directions) * np.where(DEGREES < 0, -1, 1))


@pytest.mark.parametrize("heading", range(4))
def test_turning_the_agent_equals_turning_the_world(heading: int) -> None:
    directions = sphere(50)
    # What is due east lies in front of an agent that faces east: the world turned to the left.
    angle = np.pi / 2 * heading
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = directions @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    np.testing.assert_allclose(
        sh(directions) @ rotation_to_heading(heading).T, sh(turned), atol=1e-12
    )
