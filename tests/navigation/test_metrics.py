import numpy as np
import torch

from avn.navigation.metrics import sna, soft_spl, spl


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
