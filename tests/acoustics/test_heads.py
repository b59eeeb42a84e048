"""Heads: what their ears hear of plane waves, against measurements and against a known sphere."""

import hashlib
import shutil
from importlib import resources

import numpy as np
import pytest
import soundfile
from ears import (
    delays,
    gains,
    heard,
    level_differences,
    pulses,
    sphere_points,
    time_differences,
    towards,
    write_head,
)

from avn.acoustics import heads, materials, sh_fit
from avn.acoustics.brir import assets_hash
from avn.acoustics.heads import NAMES, head_content, head_filters, load_head
from avn.acoustics.hrtf import LEVEL_RATE, load_sh_hrirs, mirrored
from avn.acoustics.sh_fit import FEWEST, LARGEST_GAP, fit_sh_hrirs, solid_angles
from avn.acoustics.sofa import MeasuredHrirs, read_sofa
from avn.core.errors import UserError

RATE = 16000
KEMAR = resources.files("avn") / "assets" / "hrirs" / "mit_kemar_normal_pinna.sofa"


def sphere(rate: int = 48000, count: int = 300) -> MeasuredHrirs:
    directions = sphere_points(count)
    responses = pulses(delays(directions), rate) * gains(directions)[..., None]
    return MeasuredHrirs(responses, directions, rate)


@pytest.fixture(scope="module")
def spherical(tmp_path_factory) -> str:
    return str(write_head(tmp_path_factory.mktemp("heads") / "sphere.sofa"))


@pytest.fixture(scope="module")
def kemar() -> MeasuredHrirs:
    return read_sofa(KEMAR)


@pytest.mark.parametrize("head", NAMES)
def test_the_ear_on_the_side_of_a_source_hears_it_earlier_and_louder(head: str) -> None:
    right, left = heard(head_filters(RATE, head)[0], towards([90, -90]))
    assert 550 < time_differences(right[None], RATE)[0] < 800
    assert -800 < time_differences(left[None], RATE)[0] < -550
    assert 3 < level_differences(right, RATE) < 20
    assert -20 < level_differences(left, RATE) < -3


@pytest.mark.parametrize("head", NAMES)
@pytest.mark.parametrize("side", [1, -1])
def test_time_differences_grow_to_the_side(head: str, side: int) -> None:
    responses = heard(head_filters(RATE, head)[0], towards(side * np.arange(0, 91, 15)))
    times = side * time_differences(responses, RATE)
    assert abs(times[0]) < 5
    assert (np.diff(times) > 0).all()


@pytest.mark.parametrize("head", NAMES)
def test_front_differs_from_back_and_above_from_below(head: str) -> None:
    ends = heard(head_filters(RATE, head)[0], towards([45, 135, 45, 45], [0, 0, 45, -45]))
    spectra = 20 * np.log10(np.abs(np.fft.rfft(ends, 256)[..., 16:112]))  # 1 to 7 kHz
    front, back, above, below = spectra.reshape(4, -1)
    assert np.sqrt(((front - back) ** 2).mean()) > 2  # decibels
    assert np.sqrt(((above - below) ** 2).mean()) > 2


@pytest.mark.parametrize("head", NAMES)
def test_heads_of_the_package_are_symmetric(head: str) -> None:
    left, right = load_head(head).ears
    np.testing.assert_allclose(right, mirrored(left)[1], atol=1e-9 * np.abs(left).max())


def test_the_fit_has_the_differences_of_the_measurement(kemar: MeasuredHrirs) -> None:
    measured = kemar.responses[::3]
    fitted = heard(load_head("kemar").ears, kemar.directions[::3])
    times = time_differences(fitted, kemar.rate) - time_differences(measured, kemar.rate)
    levels = level_differences(fitted, kemar.rate) - level_differences(measured, kemar.rate)
    rms = [float(np.sqrt((error**2).mean())) for error in (times, levels)]
    print(f"ITD: rms {rms[0]:.0f}, largest {np.abs(times).max():.0f} us")
    print(f"ILD: rms {rms[1]:.1f}, largest {np.abs(levels).max():.1f} dB")
    assert rms[0] < 30
    assert np.abs(times).max() < 120
    assert rms[1] < 2
    assert np.abs(levels).max() < 7
    assert abs(times.mean()) < 5
    assert abs(levels.mean()) < 0.2


def test_the_low_frequencies_are_those_of_the_measurement(kemar: MeasuredHrirs) -> None:
    """The ratio of both ears, amplitude and phase, which no equalisation changes.

    What is left is the shoulders, which the third order does not reach.
    """
    spectra = [
        np.fft.rfft(responses, 1024)
        for responses in (heard(load_head("kemar").ears, kemar.directions), kemar.responses)
    ]
    frequencies = np.fft.rfftfreq(1024, 1 / kemar.rate)
    for low, high, phase, level in ((200, 500, 0.1, 0.8), (500, 1000, 0.2, 1.6)):
        own = (frequencies > low) & (frequencies < high)
        fitted, measured = (found[:, 1, own] / found[:, 0, own] for found in spectra)
        band = fitted / measured
        assert np.sqrt((np.angle(band) ** 2).mean()) < phase  # radians
        assert np.sqrt(((20 * np.log10(np.abs(band))) ** 2).mean()) < level


def test_a_head_of_pure_delays_comes_back_as_it_is(spherical: str) -> None:
    directions = towards(np.arange(-75, 76, 15))
    wanted = delays(directions)
    responses = heard(load_head(spherical).ears, directions)
    times = time_differences(responses, 48000)
    np.testing.assert_allclose(times, (wanted[:, 0] - wanted[:, 1]) * 1e6, atol=15)
    levels = 12 * directions[:, 0]  # both ears, 6 dB each
    np.testing.assert_allclose(level_differences(responses, 48000), levels, atol=1)


def test_a_field_of_third_order_comes_back_in_each_channel() -> None:
    """Ears whose responses are one pulse times a sum of harmonics, all channels and both ears."""
    wanted = np.random.default_rng(0).normal(size=(2, 16))
    wanted[:, 0] = 8
    directions = sphere_points(200)
    responses = heard(wanted[..., None], directions) * pulses(np.zeros(1), 48000)
    fitted = fit_sh_hrirs(MeasuredHrirs(responses, directions, 48000))
    for frequency in (500, 1000, 4000, 8000):
        spectrum = np.fft.rfft(fitted.ears, 960)[..., frequency // 50]
        found = spectrum / spectrum[0, 0] * wanted[0, 0]
        np.testing.assert_allclose(found, wanted, atol=0.12)


def test_ears_may_differ(tmp_path) -> None:
    measured = sphere()
    softer = measured.responses * [[[1.0], [0.5]]]
    path = write_head(tmp_path / "asymmetric.sofa", Data_IR=softer)
    front = heard(load_head(str(path)).ears, towards([0.0]))
    assert level_differences(front, 48000)[0] == pytest.approx(-6.02, abs=0.05)
    assert time_differences(front, 48000)[0] == pytest.approx(0, abs=5)


@pytest.mark.parametrize("rate", [16000, 22050, 44100, 96000])
def test_any_sampling_rate_is_the_same_head(rate: int) -> None:
    directions = towards([30, -60, 75])
    filters = fit_sh_hrirs(sphere(rate)).filters(RATE)[0]
    usual = fit_sh_hrirs(sphere(48000)).filters(RATE)[0]
    one, other = (time_differences(heard(own, directions), RATE) for own in (filters, usual))
    np.testing.assert_allclose(one, other, atol=10)


@pytest.mark.parametrize("head", NAMES)
@pytest.mark.parametrize("rate", [LEVEL_RATE, 48000])
def test_the_level_of_every_head_is_that_of_an_omnidirectional_microphone(head, rate) -> None:
    front = heard(head_filters(rate, head)[0], towards(0.0))
    spectrum = np.abs(np.fft.rfft(front, 3 * rate // 100)) ** 2
    heard_at_16_khz = np.fft.rfftfreq(3 * rate // 100, 1 / rate) <= 8000
    assert spectrum[:, heard_at_16_khz].mean() == pytest.approx(1, rel=0.06)


def test_the_diffuse_field_is_flat_and_as_late_as_that_of_the_default_head() -> None:
    share = np.repeat(1 / np.array([1, 3, 5, 7]), [1, 3, 5, 7])
    ears, rate = load_head("kemar").ears, load_head("kemar").rate
    power = (np.abs(np.fft.rfft(ears, 4096)) ** 2 * share[:, None]).sum(axis=(0, 1))
    frequencies = np.fft.rfftfreq(4096, 1 / rate)
    octaves = [
        10 * np.log10(power[(frequencies > f / 2**0.5) & (frequencies < f * 2**0.5)].mean())
        for f in (250, 500, 1000, 2000, 4000, 8000)
    ]
    assert np.ptp(octaves) < 1.5
    peaks = [
        np.abs(heard(head_filters(RATE, head)[0], towards(0.0))).argmax(axis=-1) for head in NAMES
    ]
    assert np.ptp(peaks) <= 3  # samples at 16 kHz


def test_little_is_cut_off_the_filters() -> None:
    ears, rate = load_head("kemar").ears, load_head("kemar").rate
    energy = (ears**2).sum(axis=(0, 1)) / (ears**2).sum()
    assert energy[: round(0.0001 * rate)].sum() < 1e-3
    assert energy[-round(0.0005 * rate) :].sum() < 1e-3


def test_what_lies_below_a_head_without_measurements_there_stays_in_bounds() -> None:
    below, low = heard(load_head("kemar").ears, towards(0.0, [-90, -40]))
    assert abs(10 * np.log10((below**2).sum() / (low**2).sum())) < 6


def test_weights_are_solid_angles() -> None:
    # twice as dense in the upper half, which does not make it count twice
    upper, lower = (sphere_points(count) for count in (800, 400))
    directions = np.concatenate([upper[upper[:, 2] > 0], lower[lower[:, 2] < 0]])
    weights = solid_angles(directions, "head")
    assert weights.sum() == pytest.approx(1)
    assert weights[directions[:, 2] > 0].sum() == pytest.approx(0.5, abs=0.02)


def test_few_directions_and_gaps_are_refused() -> None:
    points = sphere_points(400)
    with pytest.raises(UserError, match=rf"head: {FEWEST - 1} directions are too few; .* {FEWEST}"):
        solid_angles(sphere_points(FEWEST - 1), "head")
    solid_angles(sphere_points(FEWEST), "head")
    circle = towards(np.arange(0, 360, 5.0))
    for few in (circle, points[points[:, 2] > 0], points[points[:, 0] > 0]):
        with pytest.raises(UserError, match=r"do not cover the sphere.* 65 degrees of everywhere"):
            solid_angles(few, "head")
    edge = -np.cos(np.radians(LARGEST_GAP - 3))
    solid_angles(points[points[:, 2] > edge], "head")


@pytest.mark.parametrize("key", ["acoustics.head", "training.acoustics.head"])
def test_what_is_no_head_is_refused(key: str, tmp_path) -> None:
    with pytest.raises(UserError, match=rf"^{key}: 'bob' is none of ku100, kemar, nor"):
        load_head("bob", key)
    with pytest.raises(UserError, match=rf"^{key}: .*none\.sofa: no such file; give"):
        load_head(str(tmp_path / "none.sofa"), key)


def test_a_file_is_known_by_its_content(spherical: str, tmp_path) -> None:
    copy = shutil.copy(spherical, tmp_path / "copy.sofa")
    assert head_content(str(copy)) == head_content(spherical)
    assert assets_hash(str(copy)) == assets_hash(spherical)
    assert head_content(str(KEMAR)) == head_content("kemar")
    assert len({assets_hash(head) for head in (*NAMES, spherical)}) == 3
    before = head_filters(RATE, str(copy))
    other = write_head(tmp_path / "other.sofa", count=200)
    shutil.copy(other, copy)
    assert head_content(str(copy)) != head_content(spherical)
    assert not np.array_equal(before, head_filters(RATE, str(copy)))


def test_a_new_method_of_fitting_makes_other_heads(monkeypatch) -> None:
    before = {head: head_content(head) for head in NAMES}
    monkeypatch.setattr(sh_fit, "VERSION", sh_fit.VERSION + 1)
    assert heads.head_content("ku100") == before["ku100"]
    assert heads.head_content("kemar") != before["kemar"]


def test_the_default_head_has_the_hash_of_before_there_were_others() -> None:
    """It is what the fingerprints of users' products hold."""
    asset = resources.files("avn") / "assets" / "hrirs" / "omnitone_third_order.wav"
    content = hashlib.sha256(repr(materials.NAMES).encode())
    for table in (materials.absorption(materials.NAMES), materials.scattering(materials.NAMES)):
        content.update(np.ascontiguousarray(table).tobytes())
    content.update(np.ascontiguousarray(soundfile.read(str(asset))[0].T).tobytes())
    assert assets_hash() == assets_hash("ku100") == content.hexdigest()
    assert load_head() is load_sh_hrirs()
