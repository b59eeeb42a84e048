from collections import Counter

import numpy as np

from avn.core.random import Draws, derive, scramble, uniform


def test_scramble_gives_the_published_numbers_of_splitmix64() -> None:
    numbers = scramble(1234567, np.arange(5))
    assert numbers.tolist() == [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]


def test_uniform_fills_the_unit_interval_evenly() -> None:
    draws = uniform(derive("test"), np.arange(20_000))
    counts, _ = np.histogram(draws, bins=10, range=(0.0, 1.0))
    assert counts.sum() == 20_000
    # Chi-square with 9 degrees of freedom: 27.9 is passed once in a thousand.
    assert ((counts - 2000) ** 2 / 2000).sum() < 27.9


def test_keys_tell_names_apart_and_stay_the_same() -> None:
    assert derive("a", "bc") != derive("ab", "c")
    assert derive("starts", 0, "room_1") == derive("starts", 0, "room_1")
    assert derive("starts", 0, "room_1") != derive("starts", 1, "room_1")


def test_draws_are_the_numbers_of_the_stream() -> None:
    draws = Draws(1234567)
    assert [draws.bits() for _ in range(5)] == scramble(1234567, np.arange(5)).tolist()
    key = derive("test")
    draws = Draws(key)
    assert [draws.random() for _ in range(9)] == uniform(key, np.arange(9)).tolist()


def test_draws_take_every_value_and_none_outside() -> None:
    draws = Draws(1)
    assert {draws.integers(3) for _ in range(200)} == {0, 1, 2}
    assert {draws.integers(5, 8) for _ in range(200)} == {5, 6, 7}
    assert {draws.choice("ab") for _ in range(100)} == {"a", "b"}
    assert all(-1.0 <= draws.uniform(-1.0, 2.0) < 2.0 for _ in range(200))
    orders = Counter(tuple(draws.permutation(3)) for _ in range(6000))
    assert len(orders) == 6
    assert max(orders.values()) < 1.15 * 1000  # 5 standard deviations
    values = list("abcde")
    draws.shuffle(values)
    assert sorted(values) == list("abcde")


def test_draws_are_the_same_in_all_versions() -> None:
    draws = Draws(7)
    drawn = (draws.integers(1000), draws.choice(range(1000)), draws.permutation(6))
    assert drawn == (389, 16, [3, 4, 0, 1, 2, 5])
