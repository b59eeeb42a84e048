"""Intervals for new apartments: closed forms, and their coverage in simulations."""

import numpy as np
import pytest
from scipy import stats

from avn.reporting import bootstrap
from avn.reporting.bootstrap import MIN_GROUPS, Nested, estimate


def nest(values):
    """Values (A, S, E, K, M) of E starts of S sources of A apartments."""
    scenes, sources, starts = values.shape[:3]
    return Nested(
        values.reshape(-1, *values.shape[3:]),
        np.ones(scenes * sources * starts),
        np.repeat(np.arange(scenes * sources), starts),
        np.repeat(np.arange(scenes), sources),
    )


def beta(rng, mean, sd, size):
    """Rates with a mean and a standard deviation."""
    mean = np.clip(mean, 1e-3, 1 - 1e-3)
    scale = mean * (1 - mean) / np.minimum(sd**2, 0.8 * mean * (1 - mean)) - 1
    return rng.beta(mean * scale, (1 - mean) * scale, size)


def walked(rng, scenes, count, rate, scene_sd, source_sd, sounds=3):
    """Success and SPL of `count` simulated benchmarks in new apartments, (A, 5, 20, 1, 2 count)."""
    scene = beta(rng, np.full((scenes, 1, 1, count), rate), scene_sd, (scenes, 1, 1, count))
    source = beta(rng, scene, source_sd, (scenes, 5, 1, count))
    start = beta(rng, source, 0.25, (scenes, 5, 20, count))
    # the same starts are walked with each sound
    success = (rng.random((sounds, *start.shape)) < start).astype(np.float64)
    spl = (success * rng.uniform(0.5, 1, success.shape)).mean(axis=0)
    return np.concatenate((success.mean(axis=0), spl), axis=-1)[:, :, :, None]


def share_covered(found, truth):
    return np.mean((found.low <= truth) & (truth <= found.high))


@pytest.fixture
def quick(monkeypatch):
    """Fewer resamples, for each simulated benchmark is a column of one call."""
    monkeypatch.setattr(bootstrap, "POOL", 150)
    return {"draws": 700}


# apartments; benchmarks; success rate and its standard deviation between apartments and sources
CASES = (
    (5, 300, 0.1, 0.05, 0.15),
    (5, 300, 0.8, 0.1, 0.1),
    (10, 200, 0.5, 0.1, 0.1),
    (20, 120, 0.8, 0.05, 0.15),
    (50, 80, 0.5, 0.1, 0.1),
)


@pytest.mark.parametrize(("scenes", "count", "rate", "scene_sd", "source_sd"), CASES)
def test_intervals_cover_the_mean_over_new_apartments(
    quick, scenes, count, rate, scene_sd, source_sd
):
    values = walked(np.random.default_rng(scenes), scenes, count, rate, scene_sd, source_sd)
    covered = share_covered(estimate(nest(values), **quick), np.repeat([rate, 0.75 * rate], count))
    # success and SPL of `count` benchmarks, which go together, seldom leave this range at 0.945
    assert abs(covered - 0.945) < 2.5 * np.sqrt(0.945 * 0.055 / count)


def test_sources_that_count_as_independent_say_more_than_they_know(quick):
    values = walked(np.random.default_rng(5), 5, 300, 0.8, 0.1, 0.1)
    whole, truth = nest(values), np.repeat([0.8, 0.6], 300)
    apart = Nested(whole.sums, whole.counts, whole.source, np.zeros_like(whole.scene))
    assert share_covered(estimate(apart, **quick), truth) < 0.85


def test_intervals_of_one_apartment_cover_its_mean_over_new_sources(quick):
    values = walked(np.random.default_rng(1), 5, 300, 0.7, 0.12, 0.001)
    values = values[:, :1].swapaxes(0, 1)  # apartments that vary are sources of one
    found = estimate(nest(values), **quick)
    assert 0.91 <= share_covered(found, np.repeat([0.7, 0.525], 300)) <= 0.985
    assert found.over == "sources and episodes of this apartment"


@pytest.mark.parametrize(("networks", "network_sd"), [(3, 0.03), (5, 0.06)])
def test_intervals_of_several_networks_cover_the_mean_over_new_networks(
    quick, networks, network_sd
):
    rng, count = np.random.default_rng(networks), 300
    values = 0.08 * rng.standard_normal((5, 1, 1, 1, count))
    values = values + 0.1 * rng.standard_normal((5, 5, 1, 1, count))
    values = values + network_sd * rng.standard_normal((1, 1, 1, networks, count))
    values = values + 0.4 * rng.standard_normal((5, 5, 10, networks, count))
    found = estimate(nest(values), **quick)
    assert 0.92 <= share_covered(found, 0.0) <= 0.985
    assert found.over == "networks, apartments, sources and episodes"
    if network_sd > 0.05:  # these networks alone say nothing of new ones
        alone = estimate(nest(values.mean(axis=3, keepdims=True)), **quick)
        assert share_covered(alone, 0.0) < 0.92


def test_errors_are_those_of_a_t_test_of_the_apartments():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(8, 5, 4, 1, 3))
    found = estimate(nest(values))
    scenes = values.mean(axis=(1, 2, 3))
    assert found.mean == pytest.approx(scenes.mean(axis=0))
    assert found.error == pytest.approx(stats.sem(scenes))
    assert found.df.tolist() == [7, 7, 7]
    # of many apartments, so are the ends
    many = rng.normal(size=(200, 2, 2, 1, 1))
    found = estimate(nest(many))
    low, high = stats.t.interval(0.95, 199, found.mean[0], found.error[0])
    assert found.low[0] == pytest.approx(low, abs=0.1 * found.error[0])
    assert found.high[0] == pytest.approx(high, abs=0.1 * found.error[0])


def test_networks_and_apartments_add_their_variances():
    rng = np.random.default_rng(1)
    scene, network = rng.normal(size=(6, 1)), rng.normal(size=(1, 4))
    values = (scene + network)[:, None, None, :, None]
    found = estimate(nest(values))
    variances = stats.sem(scene[:, 0]) ** 2, stats.sem(network[0]) ** 2
    assert found.error[0] == pytest.approx(np.sqrt(sum(variances)))
    assert found.df[0] == pytest.approx(
        sum(variances) ** 2 / (variances[0] ** 2 / 5 + variances[1] ** 2 / 3)
    )
    assert found.spread[0] == pytest.approx(network.std(ddof=1))
    assert found.networks == 4


def test_what_does_not_vary_is_known_exactly():
    found = estimate(nest(np.full((5, 5, 4, 1, 1), 0.1)))
    assert found.low == pytest.approx([0.1], abs=1e-12)
    assert found.high == pytest.approx([0.1], abs=1e-12)
    assert found.error == pytest.approx([0.0], abs=1e-12)
    rates = estimate(nest(np.ones((5, 5, 4, 3, 1))))  # of three networks
    assert (rates.low[0], rates.high[0], rates.spread[0]) == (1.0, 1.0, 0.0)


def test_ends_of_rates_stay_rates():
    rng = np.random.default_rng(3)
    for rate in (0.02, 0.98):
        values = (rng.random((5, 5, 4, 1, 50)) < rate).astype(np.float64)
        found = estimate(nest(values))
        assert (found.low >= -1e-12).all()
        assert (found.high <= 1 + 1e-12).all()


def test_few_apartments_and_few_sources_have_no_interval():
    values = np.random.default_rng(4).normal(size=(MIN_GROUPS, 5, 4, 1, 2))
    assert (estimate(nest(values)).low < estimate(nest(values)).high).all()
    few = estimate(nest(values[:-1]))
    assert np.isnan([few.low, few.high]).all()
    assert np.isfinite([few.mean, few.error]).all()
    assert np.isfinite(estimate(nest(values[:1])).low).all()
    assert np.isnan(estimate(nest(values[:1, :-1])).low).all()
    one = estimate(nest(values[:1, :1]))
    assert np.isfinite(one.mean).all()
    assert np.isnan([one.low, one.error]).all()


def test_apartments_have_equal_weight_unless_episodes_count():
    values = np.random.default_rng(5).normal(size=(6, 2, 8, 1, 1))
    whole = nest(values)
    kept = np.ones(96, dtype=bool)
    kept[:12] = False  # the first apartment has a quarter of its starts
    source = whole.source[kept]
    part = Nested(whole.sums[kept], whole.counts[kept], source - source[0], whole.scene[1:])
    scenes = [part.sums[:4].mean(), *values[1:].mean(axis=(1, 2, 3, 4))]
    assert estimate(part).mean[0] == pytest.approx(np.mean(scenes))
    assert estimate(part, equal=False).mean[0] == pytest.approx(part.sums.mean())


def test_a_missing_value_leaves_its_own_metric_unknown():
    values = np.random.default_rng(6).normal(size=(5, 5, 4, 1, 2))
    values[0, 0, 0, 0, 1] = np.nan
    found = estimate(nest(values))
    assert np.isfinite([found.low[0], found.high[0]]).all()
    assert np.isnan([found.mean[1], found.low[1], found.high[1]]).all()


def test_the_same_seed_gives_the_same_interval():
    values = nest(np.random.default_rng(7).normal(size=(5, 5, 4, 1, 2)))
    assert (estimate(values).low == estimate(values).low).all()
    assert (estimate(values).low != estimate(values, seed=1).low).any()
