import dataclasses
import multiprocessing

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from avn.acoustics import materials
from avn.acoustics.ambisonics import sh
from avn.acoustics.band_filters import band_firs, band_weights, half_length, minimum_phase
from avn.acoustics.brir import (
    AcousticsConfig,
    assets_hash,
    check_config,
    combine,
    cut_off_energy,
    head_filters,
    render_direct_paths,
    render_source,
)
from avn.acoustics.materials import BANDS, SPEED_OF_SOUND
from avn.acoustics.rendering import Binaural, ambisonic_responses, binaural_responses, to_int16
from avn.acoustics.tracer import Events, trace
from avn.apartments.floor_plan import Doorway, FloorPlan, Room
from avn.apartments.surfaces import Surfaces, build_surfaces, shoebox
from avn.apartments.walls import walls
from avn.core.errors import UserError

CONFIG = AcousticsConfig(seconds=0.3, rays=2000)
DIFFRACTION = dataclasses.replace(CONFIG, name="diffraction", direct_path="diffraction")
ROOM = (5.0, 4.0, 2.6)
SOURCE = np.array([1.0, 1.0, 1.0])


def decibel(energy: NDArray) -> NDArray[np.float64]:
    return 10 * np.log10(energy)


def one_event(energy: list[float], arrival: list[float], metres: float = 34.3) -> Events:
    return Events(
        np.array([0, 1]), np.array([metres], np.float32), np.array([energy], np.float32),
        np.array([arrival], np.float32), np.array([1], np.int8), 0.3,
    )  # fmt: skip


def turned(surfaces: Surfaces) -> Surfaces:
    """The same surfaces with the world turned by 90 degrees clockwise: (x, y) -> (y, -x)."""
    lower, upper = surfaces.lower.copy(), surfaces.upper.copy()
    offset, axis = surfaces.offset.copy(), surfaces.axis.copy()
    on_x, on_y, on_z = (surfaces.axis == a for a in range(3))
    axis[on_x], axis[on_y] = 1, 0
    offset[on_x] *= -1  # x = c becomes y = -c, with y (now x) and z as bounds
    # y = c becomes x = c, with bounds of x turned into -x along y.
    lower[on_y, 0], upper[on_y, 0] = -surfaces.upper[on_y, 0], -surfaces.lower[on_y, 0]
    lower[on_z] = np.column_stack([surfaces.lower[on_z, 1], -surfaces.upper[on_z, 0]])
    upper[on_z] = np.column_stack([surfaces.upper[on_z, 1], -surfaces.lower[on_z, 0]])
    return dataclasses.replace(surfaces, axis=axis, offset=offset, lower=lower, upper=upper)


def turned_points(points: NDArray) -> NDArray[np.float64]:
    return np.stack([points[..., 1], -points[..., 0], points[..., 2]], axis=-1)


def two_rooms() -> FloorPlan:
    def room(x: float) -> Room:
        return Room("bedroom", x, 0.0, x + 3, 4.0, "parquet", "plaster", "ceiling_plaster")

    return FloorPlan("two", (room(0.0), room(3.0)), (Doorway(3, 1, "y"),))


@pytest.mark.parametrize("config", [CONFIG, DIFFRACTION])
def test_turning_the_agent_is_turning_the_world_for_the_first_arrival(
    config: AcousticsConfig,
) -> None:
    blocks = walls(two_rooms())
    receivers = np.array([[2.0, 3.0, 1.5], [4.5, 3.0, 1.5], [5.5, 0.5, 1.5]])
    first = render_direct_paths(blocks, SOURCE, receivers, config)
    x0, y0, x1, y1 = blocks.T
    other = render_direct_paths(
        np.column_stack([y0, -x1, y1, -x0]), turned_points(SOURCE), turned_points(receivers), config
    )
    # Who faced north and is turned with the world faces east.
    assert np.abs(first.samples.astype(int) - np.roll(other.samples, -1, axis=1)).max() <= 1
    assert other.scale == pytest.approx(first.scale, rel=1e-4)
    assert np.array_equal(other.onset, first.onset)


def test_turning_the_agent_is_turning_the_world_for_the_reverberation() -> None:
    # Behind a doorway between rooms that absorb much, what comes through it is what is heard.
    # Drawn signs make echoes cancel or not; over many places near each other that evens out.
    surfaces = build_surfaces(two_rooms())
    receivers = np.array([[x, y, 1.5] for x in np.arange(3.6, 5.7, 0.3) for y in (0.5, 1.0, 1.5)])
    config = dataclasses.replace(CONFIG, rays=10000)
    much = np.full((len(surfaces.materials), 6), 0.7)
    one = render_source(surfaces, SOURCE, receivers, config, absorption=much)
    other = render_source(
        turned(surfaces), turned_points(SOURCE), turned_points(receivers), config, absorption=much
    )
    here, there = (
        decibel(((t.samples * t.scale[:, None, None, None]) ** 2).sum(axis=(0, 3)))
        for t in (one, other)
    )
    assert here == pytest.approx(np.roll(there, -1, axis=0), abs=1.0)
    # The check can fail: ears that face elsewhere hear another level.
    assert np.abs(here - there).max() > 2.0


def test_an_event_turned_with_its_listener_sounds_the_same() -> None:
    binaural = Binaural.prepare(head_filters(16000), 4800, 16000)
    east = np.array([0.8, 0.36, 0.48])
    one, _ = binaural_responses(one_event([1.0] * 6, list(east)), binaural, 16000)
    moved = list(turned_points(east))
    other, _ = binaural_responses(one_event([1.0] * 6, moved), binaural, 16000)
    assert np.abs(one.astype(int) - np.roll(other, -1, axis=1)).max() <= 2


def test_a_reflection_sounds_like_a_first_arrival_from_there() -> None:
    """Both ways of rendering agree in level, time and the ears' responses."""
    source = np.array([20.0, 5.0, 4.0])
    ear = np.array([[0.0, 0.0, 1.5]])
    config = dataclasses.replace(CONFIG, air=False)
    first = render_direct_paths(np.zeros((0, 4)), source, ear, config)
    way = float(np.linalg.norm(source - ear[0]))
    event = one_event([1 / (4 * np.pi * way**2)] * 6, list((source - ear[0]) / way), metres=way)
    samples, scale = binaural_responses(
        event, Binaural.prepare(head_filters(16000), 4800, 16000), 16000
    )
    heard = samples[0] * scale[0]
    wanted = np.zeros_like(heard)
    onset, taps = int(first.onset[0]), first.samples.shape[-1]
    wanted[..., onset : onset + taps] = first.samples[0] * first.scale[0]
    assert np.abs(heard - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_bands_sum_to_a_single_sample() -> None:
    firs = band_firs(16000)
    unit = np.zeros(2 * half_length(16000) + 1)
    unit[half_length(16000)] = 1
    assert firs.sum(axis=0) == pytest.approx(unit, abs=1e-6)
    assert band_weights(np.linspace(0, 8000, 500)).sum(axis=0) == pytest.approx(np.ones(500))


def test_a_band_has_its_energy_at_its_centre() -> None:
    spectra = np.abs(np.fft.rfft(band_firs(16000), 16000, axis=1))[:, list(BANDS)]
    assert np.diag(spectra) == pytest.approx(np.ones(6), abs=0.08)
    assert (spectra - np.diag(np.diag(spectra))).max() < 0.08


def test_minimum_phase_filters_start_at_once_and_have_their_gains() -> None:
    gains = np.array([[1.0, 0.7, 0.5, 0.3, 0.2, 0.1], [0.5] * 6])
    filters = minimum_phase(gains, 16000, 128)
    heights = np.abs(np.fft.rfft(filters, 16000, axis=1))[:, list(BANDS)]
    assert heights == pytest.approx(gains, rel=0.08)
    assert filters[1, 0] == pytest.approx(0.5)
    assert np.abs(filters[1, 1:]).max() < 1e-9


def test_the_omnidirectional_channel_keeps_the_traced_energy() -> None:
    """What is rendered is what was traced, band by band and over time."""
    events = trace(
        shoebox(ROOM, "plaster"), SOURCE, np.array([[3.0, 2.0, 1.5], [4.0, 3.0, 1.5]]),
        rays=8000, seconds=0.3, absorption=np.full((1, 6), 0.2),
    )  # fmt: skip
    omni = ambisonic_responses(events, 0, 2, 5000, 16000)[:, 0, half_length(16000) :][:, :4800]
    traced = events.histogram()
    assert decibel((omni**2).sum(axis=1)) == pytest.approx(
        decibel(traced.mean(axis=2).sum(axis=1)), abs=1.0
    )
    halves = decibel((omni.reshape(2, 2, -1) ** 2).sum(axis=2))
    assert halves == pytest.approx(
        decibel(traced.mean(axis=2).reshape(2, 2, -1).sum(axis=2)), abs=1.5
    )


def test_direct_to_reverberant_ratio_falls_with_distance() -> None:
    receivers = np.array([[1.0 + d, 1.0 + d / 2, 1.5] for d in (0.5, 1.2, 2.2, 3.5)])
    surfaces = shoebox(ROOM, "plaster")
    reverberation = render_source(surfaces, SOURCE, receivers, CONFIG)
    first = render_direct_paths(np.zeros((0, 4)), SOURCE, receivers, CONFIG)
    reverberant = ((reverberation.samples * reverberation.scale[:, None, None, None]) ** 2).sum(
        axis=(1, 2, 3)
    )
    direct = ((first.samples * first.scale[:, None, None, None]) ** 2).sum(axis=(1, 2, 3))
    assert (np.diff(decibel(direct / reverberant)) < -2).all()


def test_bytes_do_not_depend_on_the_number_of_processes() -> None:
    surfaces = build_surfaces(two_rooms())
    receivers = np.array([[x, y, 1.5] for x in (0.5, 2.0, 4.5) for y in (0.5, 2.5)])
    config = dataclasses.replace(CONFIG, rays=300)
    jobs = [(surfaces, np.array([x, 1.0, 1.0]), receivers, config) for x in (1.0, 5.0)]
    alone = [render_source(*job) for job in jobs]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        shared = pool.starmap(render_source, jobs)
    for one, other in zip(alone, shared, strict=True):
        for name in ("samples", "scale", "cut_db"):
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes()
    assert alone[0].samples.tobytes() != alone[1].samples.tobytes()


def test_listeners_in_other_company_hear_the_same() -> None:
    surfaces = build_surfaces(two_rooms())
    receivers = np.array([[x, y, 1.5] for x in (0.5, 1.5, 2.5, 4.5, 5.5) for y in (0.5, 2.5)])
    config = dataclasses.replace(CONFIG, rays=300)
    everyone = render_source(surfaces, SOURCE, receivers, config)
    few = trace(surfaces, SOURCE, receivers[:3], rays=300, seconds=0.3)
    samples, scale = binaural_responses(
        few, Binaural.prepare(head_filters(16000), 4800, 16000), 16000
    )
    assert np.abs(samples.astype(int) - everyone.samples[:3]).max() <= 1
    assert scale == pytest.approx(everyone.scale[:3], rel=1e-5)


def test_what_is_cut_off_is_measured() -> None:
    """In a room whose decay is known, the share after `seconds` is known too."""
    events = trace(
        shoebox(ROOM, "plaster"), SOURCE, np.array([[3.0, 2.0, 1.5], [4.0, 3.0, 1.5]]),
        rays=10000, seconds=0.15, absorption=np.full((1, 6), 0.2), scattering=np.ones((1, 6)),
        air=False,
    )  # fmt: skip
    longer = trace(
        shoebox(ROOM, "plaster"), SOURCE, np.array([[3.0, 2.0, 1.5], [4.0, 3.0, 1.5]]),
        rays=10000, seconds=0.225, absorption=np.full((1, 6), 0.2), scattering=np.ones((1, 6)),
        air=False,
    )  # fmt: skip
    energy = longer.histogram().sum(axis=2)
    share = energy[:, 150:].sum(axis=1) / energy.sum(axis=1)
    assert cut_off_energy(events) == pytest.approx(decibel(share), abs=1.0)


def test_combining_adds_the_first_arrival_at_its_onset() -> None:
    receivers = np.array([[3.0, 2.0, 1.5]])
    reverberation = render_source(shoebox(ROOM, "plaster"), SOURCE, receivers, CONFIG)
    first = render_direct_paths(np.zeros((0, 4)), SOURCE, receivers, CONFIG)
    added = combine(reverberation, first) - reverberation.samples * reverberation.scale[0]
    onset, taps = int(first.onset[0]), first.samples.shape[-1]
    assert onset == round(np.linalg.norm(receivers[0] - SOURCE) / SPEED_OF_SOUND * 16000)
    assert added[0, ..., onset : onset + taps] == pytest.approx(
        first.samples[0] * first.scale[0], abs=1e-7
    )
    assert np.abs(added[0, ..., :onset]).max() == 0


def test_first_arrivals_of_a_regime_have_one_length() -> None:
    """So that those of several sources can be stacked, behind walls or not."""
    receivers = np.array([[2.0, 2.0, 1.5]])
    lengths = {
        render_direct_paths(blocks, SOURCE, receivers, DIFFRACTION).samples.shape
        for blocks in (np.zeros((0, 4)), walls(two_rooms()))
    }
    assert len(lengths) == 1


def test_int16_keeps_nine_tenths_of_a_promille_and_silence() -> None:
    random = np.random.default_rng(0)
    responses = random.normal(size=(2, 4, 2, 50)).astype(np.float32)
    responses[1] = 0
    samples, scale = to_int16(responses)
    assert np.abs(samples[0] * scale[0] - responses[0]).max() <= 0.51 * scale[0]
    assert np.abs(samples[0]).max() == 32767
    assert scale[1] == 0
    assert not samples[1].any()


@pytest.mark.parametrize(
    ("key", "value"),
    [("rays", 0), ("seconds", -1.0), ("direct_path", "teleport"), ("receiver_radius", 0.0)],
)
def test_a_value_out_of_range_is_named(key: str, value: object) -> None:
    with pytest.raises(UserError, match=rf"^acoustics\.{key}: .*{value}.*use"):
        check_config(dataclasses.replace(CONFIG, **{key: value}))
    assert check_config(CONFIG) is CONFIG


def test_the_hash_of_the_tables_follows_what_they_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    before = assets_hash()
    assert assets_hash() == before
    louder = materials.absorption(materials.NAMES) * 0.99
    monkeypatch.setattr(materials, "absorption", lambda names: louder)
    assert assets_hash() != before


def test_direct_sound_and_reverberation_are_heard_by_the_head_of_the_config() -> None:
    source, receiver = np.array([3.0, 0.0, 1.5]), np.array([[0.0, 0.0, 1.5]])
    kemar = dataclasses.replace(CONFIG, head="kemar", air=False)
    direct = render_direct_paths(np.zeros((0, 4)), source, receiver, kemar)
    heard = direct.samples[0, 0] * direct.scale[0]
    filters = head_filters(kemar.rate, "kemar")[0].astype(np.float64)
    wanted = np.einsum("ect,c->et", filters, sh([1.0, 0.0, 0.0])) / (np.sqrt(4 * np.pi) * 3)
    np.testing.assert_allclose(heard[:, : wanted.shape[1]], wanted, atol=1e-4 * abs(wanted).max())
    late = [
        render_source(shoebox(ROOM, "plaster"), SOURCE, np.array([[2.0, 2.0, 1.5]]), config)
        for config in (dataclasses.replace(CONFIG, air=False), kemar)
    ]
    assert late[0].samples.shape == late[1].samples.shape
    assert not np.array_equal(late[0].samples, late[1].samples)


@pytest.mark.parametrize("rate", [8000, 48000])
def test_a_response_has_the_same_spectrum_at_every_sampling_rate(rate: int) -> None:
    """The direct path up to 2.5 kHz, against that at 16 kHz."""
    source, receiver = np.array([0.0, 3.0, 1.0]), np.array([[0.0, 0.0, 1.5]])
    frequencies = np.arange(200, 2501, 100)

    def levels(own: int) -> np.ndarray:
        config = dataclasses.replace(CONFIG, rate=own)
        first = render_direct_paths(np.zeros((0, 4)), source, receiver, config)
        ears = first.samples[0, 0] * first.scale[0].astype(np.float64)
        wave = np.exp(-2j * np.pi * np.outer(np.arange(ears.shape[-1]), frequencies) / own)
        return 20 * np.log10(np.abs(ears @ wave))

    np.testing.assert_allclose(levels(rate), levels(16000), atol=0.3)


@pytest.mark.parametrize("rate", [8000, 48000])
def test_reverberation_has_the_same_decay_and_level_at_every_sampling_rate(rate: int) -> None:
    receivers, energies = np.array([[4.0, 3.0, 1.5], [2.0, 3.0, 1.5]]), []
    for own in (16000, rate):
        config = dataclasses.replace(CONFIG, rate=own)
        tail = render_source(shoebox(ROOM, "plaster"), SOURCE, receivers, config)
        samples = tail.samples[:, 0, 0] * tail.scale[:, None].astype(np.float64)
        low = sosfiltfilt(butter(4, (300, 2500), "bandpass", fs=own, output="sos"), samples)
        # the spectrum does not depend on the rate, and its energy is spread over so many samples
        blocks = (low**2).reshape(len(low), -1, own // 20).sum(axis=-1) * own / 16000
        energies.append(10 * np.log10(blocks[:, :5].mean(axis=0)))
    np.testing.assert_allclose(energies[1], energies[0], atol=0.7)
