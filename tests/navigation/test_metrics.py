import numpy as np
import pytest
import torch

from avn.navigation.metrics import MIN_CLUSTERS, cluster_bootstrap, sna, soft_spl, spl


def test_spl_by_hand() -> None:
    # Straight there, twice as far as needed, shorter than the shortest walk, failed.
    values = spl([1, 1, 1, 0], [4.0, 8.0, 3.0, 4.0], [4.0, 4.0, 4.0, 4.0])
    assert values.tolist() == [1.0, 0.5, 1.0, 0.0]


def test_spl_of_the_examples_in_its_paper() -> None:
    # Anderson et al. 2018: half of the episodes succeed on the best walk, or all of them on
    # walks that are twice as long; SPL is 0.5 in both.
    shortest = np.array([3.0, 5.0, 8.0, 13.0])
    assert spl([1, 0, 1, 0], shortest, shortest).mean() == 0.5
    assert spl(np.ones(4), 2 * shortest, shortest).mean() == 0.5


def test_spl_agrees_with_its_closed_form() -> None:
    generator = torch.Generator().manual_seed(0)
    success = torch.randint(2, (1000,), generator=generator).double()
    path, shortest = 0.1 + 9.9 * torch.rand(2, 1000, generator=generator, dtype=torch.float64)
    expected = success * torch.minimum(shortest / path, torch.ones(1000, dtype=torch.float64))
    assert np.allclose(spl(success, path, shortest), expected.numpy())


def test_soft_spl_by_hand() -> None:
    # Arrived straight; half the way on a straight walk; half the way on one twice too long;
    # farther away than at the start.
    values = soft_spl([0, 2, 2, 6], [4, 2, 8, 2], [4, 4, 4, 4])
    assert values.tolist() == [1.0, 0.5, 0.25, 0.0]


def test_sna_by_hand() -> None:
    assert sna([1, 1, 0], [7, 14, 7], [7, 7, 7]).tolist() == [1.0, 0.5, 0.0]


def test_bootstrap_agrees_with_the_theory_for_equal_clusters() -> None:
    rng = np.random.default_rng(1)
    means = rng.normal(size=400)
    values = np.repeat(means, 20)[:, None] + rng.normal(scale=0.1, size=(8000, 1))
    clusters = np.repeat(np.arange(400), 20)
    low, high = cluster_bootstrap(values, clusters, draws=4000)[:, 0]
    own = values.reshape(400, 20).mean(axis=1)
    error = own.std() / np.sqrt(400)
    assert low == pytest.approx(own.mean() - 1.96 * error, abs=0.15 * error)
    assert high == pytest.approx(own.mean() + 1.96 * error, abs=0.15 * error)
    # Single episodes would claim to know the mean several times better.
    narrow = cluster_bootstrap(values, np.arange(8000), draws=500)[:, 0]
    assert high - low > 4 * (narrow[1] - narrow[0])


def test_bootstrap_covers_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(2)
    covered = 0
    for seed in range(200):
        values = np.repeat(rng.normal(size=25), 4)[:, None]
        low, high = cluster_bootstrap(values, np.repeat(np.arange(25), 4), draws=400, seed=seed)
        covered += int(low[0] <= 0.0 <= high[0])
    assert 0.87 <= covered / 200 <= 0.98


def test_a_weight_counts_as_so_many_copies() -> None:
    values = np.array([[1.0], [2.0], [4.0], [8.0], [16.0], [32.0]])
    clusters, times = np.array(["v", "w", "x", "y", "z", "z"]), np.array([1, 2, 3, 1, 1, 2])
    copied = cluster_bootstrap(np.repeat(values, times, axis=0), np.repeat(clusters, times))
    assert np.allclose(cluster_bootstrap(values, clusters, times), copied)
    assert not np.allclose(cluster_bootstrap(values, clusters), copied)


def test_few_clusters_have_no_interval() -> None:
    values = np.random.default_rng(4).normal(size=(100, 3))
    for clusters in (1, 2, MIN_CLUSTERS - 1):
        assert np.isnan(cluster_bootstrap(values, np.arange(100) % clusters)).all()
    low, high = cluster_bootstrap(values, np.arange(100) % MIN_CLUSTERS)
    assert (low < high).all()


def test_same_seed_same_interval() -> None:
    values = np.random.default_rng(3).normal(size=(100, 2))
    clusters = np.arange(100) // 4
    assert (cluster_bootstrap(values, clusters) == cluster_bootstrap(values, clusters)).all()
    other = cluster_bootstrap(values, clusters, seed=1)
    assert (cluster_bootstrap(values, clusters) != other).any()
