"""Recordings of the package: table, splits, licences and what an agent can hear of them."""

import csv
import hashlib
from collections import defaultdict
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import soundfile

from avn.acoustics.clips import fade_samples
from avn.acoustics.dry_sounds import BUILTIN, RATE, content_hash, read_sound
from avn.acoustics.sound_table import (
    SPLITS,
    packaged_file,
    packaged_sounds,
    select,
    sounds_folder,
)

LICENCES = {
    *("CC0-1.0", "public domain", "CC-BY-3.0", "CC-BY-4.0", "CC-BY-SA-3.0", "CC-BY-SA-4.0"),
    *("MIT", "BSD-3-Clause", "CMU-Flite", "Apache-2.0"),
}
NEED_TEXT = LICENCES - {"CC0-1.0", "public domain", "Apache-2.0"}
CATEGORIES = {
    *("telephone", "alarm", "clock", "doorbell", "water", "kettle", "dog", "cat", "animal"),
    *("door", "footsteps", "music", "speech", "appliance", "person", "fire"),
}


@pytest.fixture(scope="module")
def rows():
    with (sounds_folder() / "sounds.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def samples():
    return {
        name: soundfile.read(packaged_file(name), dtype="float64")[0] for name in packaged_sounds()
    }


def test_every_file_has_a_row_and_every_row_its_file(rows):
    files = {path.stem: path for path in sounds_folder().rglob("*.flac")}
    assert set(files) == {row["name"] for row in rows}
    assert len(files) == len(rows) >= 110
    for row in rows:
        content = packaged_file(row["name"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == row["sha256"]
    assert content_hash({"x": "dog_pair"})["x"] == rows_by_name(rows)["dog_pair"]["sha256"]
    size = sum(path.stat().st_size for path in sounds_folder().rglob("*") if path.is_file())
    assert size <= 15e6


def rows_by_name(rows):
    return {row["name"]: row for row in rows}


def test_every_row_has_source_credit_and_a_licence_that_permits_redistribution(rows):
    for row in rows:
        assert all(row[key] for key in ("title", "source", "file", "author")), row["name"]
        assert row["licence"] in LICENCES, row["name"]
        assert row["kind"] in ("recorded", "synthesised")
        if row["source"] != "avn":
            assert row["url"].startswith("http"), row["name"]
            assert row["version"], row["name"]
    texts = {path.name for path in sounds_folder().iterdir()}
    readme = (sounds_folder() / "README.md").read_text(encoding="utf-8")
    for licence in {row["licence"] for row in rows} & NEED_TEXT:
        assert f"]({licence_file(licence)})" in readme
        assert licence_file(licence) in texts
    assert "GPL" not in "".join(row["licence"] for row in rows)


def licence_file(licence):
    return "LICENSE.alarm.txt" if licence == "BSD-3-Clause" else f"LICENSE.{licence}.txt"


def test_every_category_has_recordings_in_each_split_and_whole_categories_are_held_out():
    splits, of_category = defaultdict(set), defaultdict(set)
    for sound in packaged_sounds().values():
        splits[sound.category].add(sound.split)
        of_category[sound.category].add(sound.category_split)
        assert sound.name in BUILTIN or sound.name.startswith(f"{sound.category}_")
    assert set(splits) == CATEGORIES
    assert all(found == set(SPLITS) for found in splits.values())
    assert all(len(found) == 1 for found in of_category.values())
    held_out = defaultdict(set)
    for category, (split,) in of_category.items():
        held_out[split].add(category)
    assert held_out["test"] == {"dog", "kettle", "speech"}
    assert held_out["validation"] == {"cat", "person"}
    assert all(
        packaged_sounds()[name].split == packaged_sounds()[name].category_split == "train"
        for name in BUILTIN
    )


def test_no_source_file_is_in_two_splits(rows):
    splits = defaultdict(set)
    for row in rows:
        for file in row["file"].split(" + ") if row["source"] != "avn" else [row["file"]]:
            splits[row["source"], file].add(row["split"])
    assert not [key for key, found in splits.items() if len(found) > 1]


def test_every_recording_is_mono_of_16_khz_unclipped_and_centred(samples):
    for name, wave in samples.items():
        info = soundfile.info(packaged_file(name))
        assert (info.samplerate, info.channels, info.subtype) == (RATE, 1, "PCM_16"), name
        assert 2 <= info.duration <= 8 or name in BUILTIN, name
        assert 0.85 < np.abs(wave).max() < 0.95, name
        if name not in BUILTIN:
            assert abs(wave.mean()) < 1e-3, name


def test_no_second_of_a_recording_is_silent(samples):
    for name, wave in samples.items():
        looped = np.resize(wave, len(wave) + RATE)
        energy = np.concatenate([[0.0], np.cumsum(looped**2)])
        power = energy[RATE:] - energy[:-RATE]
        assert power.min() > power.max() / 100, name  # 20 dB


def correlation(wave, segment):
    """Return the greatest normalised correlation of a looped wave with a segment."""
    looped = np.resize(wave, len(wave) + len(segment))
    size = 1 << (len(looped) + len(segment)).bit_length()
    product = np.fft.irfft(np.fft.rfft(looped, size) * np.conj(np.fft.rfft(segment, size)), size)
    energy = np.concatenate([[0.0], np.cumsum(looped**2)])
    norm = np.sqrt(np.maximum(energy[len(segment) :] - energy[: -len(segment)], 0))
    norm = np.maximum(norm, 0.1 * norm.max())
    return np.abs(product[: len(norm)] / norm).max() / np.sqrt((segment**2).sum())


def loudest(wave, length):
    energy = np.concatenate([[0.0], np.cumsum(wave**2)])
    start = np.argmax(energy[length:] - energy[:-length])
    return wave[start : start + length]


def coarse(wave):
    """Return the first four seconds at a quarter of the rate."""
    return wave[: len(wave[: 4 * RATE]) // 4 * 4].reshape(-1, 4).mean(axis=1)


def test_no_recording_is_a_copy_of_one_of_its_category_in_another_split(samples):
    found = {name: coarse(wave) for name, wave in samples.items()}
    for one, other in combinations(packaged_sounds().values(), 2):
        if one.category == other.category and one.split != other.split:
            alike = correlation(found[one.name], loudest(found[other.name], 1000))
            assert alike < 0.93, (one.name, other.name)


def test_the_search_for_copies_finds_one(samples):
    copy = np.roll(samples["dog_pair"], 7000) * 0.3
    assert correlation(copy, loudest(samples["dog_pair"], 4000)) > 0.99
    assert correlation(samples["dog_howl"], loudest(samples["dog_pair"], 4000)) < 0.5


def test_selections_by_split_and_category():
    assert select(["telephone"], ["train"])[0] == "ring"
    train, test = set(select(split=["train"])), set(select(split=["test"]))
    assert not train & test
    unheard = set(select(split=["test"], category_split=["train"]))
    unheard_category = set(select(split=["test"], category_split=["test"]))
    assert unheard | unheard_category < test
    assert {packaged_sounds()[name].category for name in unheard_category} == {
        "dog",
        "kettle",
        "speech",
    }


def test_a_packaged_sound_is_read_by_its_name():
    wave = read_sound("dog_pair")
    assert len(wave) >= RATE > fade_samples(RATE)
    assert np.sqrt(np.mean(wave.astype(float) ** 2)) == pytest.approx(1, abs=1e-4)


def test_the_page_counts_the_recordings(rows):
    page = (Path(__file__).parents[2] / "docs" / "sounds.md").read_text(encoding="utf-8")
    assert f"{len(rows)} recordings in {len(CATEGORIES)} categories" in page
    for category in CATEGORIES:
        own = [row for row in rows if row["category"] == category]
        counts = [sum(row["split"] == split for row in own) for split in SPLITS]
        counts += [sum(row["kind"] == kind for row in own) for kind in ("recorded", "synthesised")]
        line = [category, own[0]["category_split"], *map(str, counts)]
        assert f"| {' | '.join(line)} |" in page
