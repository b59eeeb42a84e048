import numpy as np
import pytest
from scipy.stats import entropy

from avn.planning.posterior import information

BINS = 72


def test_information_is_what_is_missing_to_a_uniform_distribution():
    halves = np.full(BINS, -np.inf, np.float32)
    halves[: BINS // 2] = np.log(2 / BINS)
    one = np.full(BINS, -np.inf, np.float32)
    one[3] = 0
    uniform = np.full(BINS, -np.log(BINS), np.float32)
    nats = information(np.stack([uniform, halves, one]))
    assert nats == pytest.approx([0, np.log(2), np.log(BINS)], abs=1e-5)


def test_information_is_the_divergence_from_a_uniform_distribution():
    shares = np.random.default_rng(0).dirichlet(np.full(BINS, 0.2), size=50)
    expected = entropy(shares, np.full_like(shares, 1 / BINS), axis=1)
    nats = information(np.log(np.maximum(shares, 1e-30)).astype(np.float32))
    assert nats == pytest.approx(expected, abs=1e-4)
