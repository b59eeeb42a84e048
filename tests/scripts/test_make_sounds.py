"""Scripts that make the recordings of the package: documents, layout, synthesised families."""

import numpy as np
import pytest
import sound_credits
import soundfile
from make_sounds import call, lay_out, synthesise
from sound_families import SYNTHESISED
from sound_layout import events, levelled, loop
from sound_packages import RATE
from sound_sources import PACKAGES, RECORDED

from avn.acoustics.sound_table import packaged_file, packaged_sounds
from avn.config.folder import conf_folder


def test_the_readme_and_the_options_agree_with_the_table(tmp_path):
    rows = sound_credits.read_table()
    readme = (sound_credits.TARGET / "README.md").read_text(encoding="utf-8")
    assert readme == sound_credits.readme(rows)
    sound_credits.write_options(rows, tmp_path)
    for path in tmp_path.iterdir():
        assert path.read_text() == (conf_folder() / "sound" / path.name).read_text()


def test_the_lists_of_the_scripts_are_the_table():
    table = packaged_sounds()
    made = {sound.name: sound.split for sound in (*RECORDED, *SYNTHESISED)}
    assert {name: table[name].split for name in made} == made
    assert set(table) - set(made) == {"ring", "alarm", "clock"}
    assert {sound.package for sound in RECORDED} | {"ovos-skill-alerts"} == set(PACKAGES)


def test_cells_of_a_family_differ_across_splits():
    cells = [(call(sound), sound.split) for sound in SYNTHESISED]
    assert len({parameters for parameters, _ in cells}) == len(cells)


@pytest.mark.parametrize("name", ["telephone_black", "telephone_wall", "telephone_kitchen"])
def test_a_family_reproduces_the_bytes_of_its_recordings(tmp_path, name):
    sound = next(sound for sound in SYNTHESISED if sound.name == name)
    path = tmp_path / "again.flac"
    soundfile.write(path, synthesise(sound), RATE, subtype="PCM_16")
    samples, _ = soundfile.read(path, dtype="int16")
    shipped, _ = soundfile.read(packaged_file(name), dtype="int16")
    np.testing.assert_array_equal(samples, shipped)


def test_a_loop_has_no_step_at_its_end():
    time = np.arange(6 * RATE) / RATE
    tone = np.sin(2 * np.pi * 333.3 * time)
    looped = loop(tone, 1.0, 3.0)
    assert len(looped) == 3 * RATE
    step = np.abs(np.diff(np.concatenate([looped, looped[:1]])))
    assert step[-1] <= 1.2 * step[:-1].max()


def test_silences_are_shortened_and_events_take_turns():
    burst = np.random.default_rng(0).standard_normal(RATE // 4)
    silence = np.zeros(2 * RATE)
    looped = loop(np.concatenate([burst, silence, burst, silence, burst]), 0, 8)
    assert len(looped) / RATE <= 2 * (3 * 0.25 + 2 * 0.35)  # repeated to two seconds
    low, high = (np.sin(2 * np.pi * f * np.arange(1600) / RATE) for f in (300, 2000))
    laid = events([low, high], 0.4, 3.0, "x")
    assert np.array_equal(laid, events([low, high], 0.4, 3.0, "x"))
    spectrum = np.abs(np.fft.rfft(laid))
    hertz = np.fft.rfftfreq(len(laid), 1 / RATE)
    peaks = [spectrum[np.abs(hertz - f) < 20].max() for f in (300, 2000)]
    assert 0.5 < peaks[0] / peaks[1] < 2


def test_levelled_is_centred_with_a_peak_of_nine_tenths():
    samples = levelled(np.random.default_rng(1).uniform(0, 3, 1000))
    assert np.abs(samples).max() == pytest.approx(0.9)
    assert samples.mean() == pytest.approx(0)


def test_a_missing_member_of_a_package_ends_the_script(tmp_path):
    (tmp_path / "scratch").mkdir()
    with pytest.raises(SystemExit, match=r"has no Effects/BellToll.wav"):
        lay_out(next(s for s in RECORDED if s.name == "clock_tower"), tmp_path)
