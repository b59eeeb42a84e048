import numpy as np

from avn.core.random import derive, scramble, uniform


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
