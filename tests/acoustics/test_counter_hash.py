"""The counter-based hash: the published generator, spread evenly, without collisions."""

import torch

from avn.acoustics.counter_hash import absorb, integers, mix


def test_first_outputs_are_those_of_splitmix64() -> None:
    expected = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    outputs = mix(torch.tensor([1, 2, 3])).tolist()
    assert [output % 2**64 for output in outputs] == expected


def test_neighbouring_words_give_keys_that_differ() -> None:
    grid = torch.cartesian_prod(*[torch.arange(30)] * 3)
    keys = absorb(torch.tensor(7), grid)
    assert len(keys.unique()) == len(grid)


def test_draws_are_uniform_and_not_negative() -> None:
    keys = absorb(torch.tensor(0), torch.arange(100_000)[:, None])
    first, second = integers(keys, 0), integers(keys, 1)
    assert int(first.min()) >= 0
    counts = torch.bincount(first % 10, minlength=10)
    assert (counts - 10_000).abs().max() < 500  # 5 standard deviations
    together = torch.stack([first, second]).double()
    assert torch.corrcoef(together)[0, 1].abs() < 0.02


def test_a_batch_draws_what_its_rows_draw_alone() -> None:
    words = torch.tensor([[1, 2], [3, 4], [-5, 6]])
    together = absorb(torch.tensor(9), words)
    alone = torch.stack([absorb(torch.tensor(9), row) for row in words])
    assert torch.equal(together, alone)
