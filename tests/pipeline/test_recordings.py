"""Recordings of runs: reports play those that a run was made with, and never mix unlike ones."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import soundfile

from avn.acoustics.dry_sounds import content_hash, read_sound
from avn.config.defaults import default_config
from avn.config.saved import read_config
from avn.core.errors import UserError
from avn.pipeline.recordings import FILE
from avn.pipeline.replay import open_run
from avn.pipeline.run_names import settings_but_seed


def write_tone(path, frequency):
    path.parent.mkdir(exist_ok=True)
    soundfile.write(path, 0.3 * np.sin(2 * np.pi * frequency * np.arange(8000) / 8000), 8000)


@pytest.fixture
def run(command, outputs, tmp_path, monkeypatch):
    """Walk with `sound=tone.wav` of a frequency in `tmp_path`; gives the folder of the run."""
    monkeypatch.chdir(tmp_path)
    mine = tmp_path / "outputs"
    if (outputs / "generate").is_dir():
        shutil.copytree(outputs / "generate", mine / "generate")

    def walk(frequency, *options, path="tone.wav"):
        write_tone(tmp_path / path, frequency)
        world = ("agent=random_walk", "split=mini", "protocol.num_starts=2", f"outputs={mine}")
        code, out, err = command("eval", *world, f"sound=./{path}", *options)
        assert code == 0, err
        return Path(out[-1])

    return walk


def opened(folder):
    cfg = read_config(folder)
    return open_run(folder, cfg, default_config(cfg))


def heard(folder):
    """The sound of a run as its films and reports take it."""
    return read_sound(opened(folder).cfg.sound.tone)


def test_a_run_keeps_its_recording(run, tmp_path, monkeypatch, capfd):
    folder = run(500)
    table = pd.read_csv(folder / FILE)
    assert table["sound"].tolist() == ["tone"]
    assert table["sha256"].tolist() == [*content_hash({"x": "tone.wav"}).values()]
    truth = read_sound("tone.wav")
    write_tone(tmp_path / "tone.wav", 900)
    np.testing.assert_array_equal(heard(folder), truth)
    assert "./tone.wav is not there or has changed" in capfd.readouterr().out
    monkeypatch.chdir(tmp_path.parent)
    np.testing.assert_array_equal(heard(folder), truth)


def test_a_recording_that_is_lost_is_refused(run, command, tmp_path):
    folder = run(500)
    shutil.rmtree(tmp_path / "outputs" / "recordings")
    heard(folder)  # that of its path is still the same
    write_tone(tmp_path / "tone.wav", 900)
    for name in ("report", "figures"):
        code, _, err = command(name, str(folder))
        assert code == 2
        assert f"{folder}: the recording ./tone.wav is not the one of the run" in err[-1]
    (folder / FILE).unlink()  # as of an earlier version
    with pytest.raises(UserError, match="its recordings have changed"):
        opened(folder)
    write_tone(tmp_path / "tone.wav", 500)
    heard(folder)


def test_seeds_are_those_of_one_recording(run):
    """Runs of one name and unlike recordings are no seeds of one row; a moved file is the same."""
    first, second = opened(run(500)), opened(run(500, "seed=1", path="moved/tone.wav"))
    other = opened(run(900, "seed=1"))
    assert settings_but_seed(first) == settings_but_seed(second)
    assert settings_but_seed(first) != settings_but_seed(other)


def test_two_recordings_of_one_stem_are_two_sounds(command, outputs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, frequency in (("a", 500), ("b", 900)):
        write_tone(tmp_path / name / "phone.wav", frequency)
    write_tone(tmp_path / "ring.wav", 700)
    world = ("agent=random_walk", "split=mini", "protocol.num_starts=2", f"outputs={outputs}")
    code, out, err = command("eval", *world, "sound=[ring,./ring.wav,a/phone.wav,b/phone.wav]")
    assert code == 0, err
    sounds = dict.fromkeys(pd.read_csv(Path(out[-1]) / "episodes.csv")["sound"])
    assert list(sounds) == ["ring", "ring.wav", "a-phone", "b-phone"]


def test_a_sound_in_place_of_a_built_in_one_is_told(command, outputs, tmp_path):
    write_tone(tmp_path / "x.wav", 500)
    world = ("agent=random_walk", "split=mini", "protocol.num_starts=2", f"outputs={outputs}")
    code, out, err = command("eval", *world, "sound=ring", f"sound.ring={tmp_path}/x.wav")
    assert code == 0, err
    assert f"sound 'ring': {tmp_path}/x.wav, in place of the built-in ring" in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("train", "model=sound_cnn", "training.sounds=no.such.wav"), "no.such.wav does not exist"),
        (("train", "model=sound_cnn", "training.sounds=text.wav"), "text.wav is not audio"),
        (("train", "model=sound_cnn", "sound=[ring,alarm,clock,no.such.wav]"), "sound: not read"),
        (("train", "model=a3c_va", "training.sounds=text.wav"), "text.wav is not audio"),
        (("eval", "agent=greedy", "sound=text.wav"), "text.wav is not audio"),
        (("eval", "agent=greedy", "training.sounds=text.wav"), "text.wav is not audio"),
        (("generate", "export=wav", "sound=text.wav"), "text.wav is not audio"),
        (("reproduce", "rows=random_walk", "sound=text.wav"), "text.wav is not audio"),
        (("eval", "agent=random_walk", "sound=bell\udcff.wav"), r"bell\xff.wav: not valid UTF-8"),
    ],
)
def test_a_bad_sound_is_refused_before_anything_is_made(
    command, tmp_path, monkeypatch, arguments, said
):
    monkeypatch.chdir(tmp_path)
    Path("text.wav").write_text("not a sound")
    assert said in refused_at_once(command, *arguments)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("eval", "agent=greedy", "microphone.gain=0"), "microphone.gain=0"),
        (("eval", "agent=greedy", "training.microphone.gain=0"), "training.microphone.gain=0"),
        (
            ("eval", "agent=belief", "microphone=white", "microphone.snr=[10]"),
            "microphone.snr: [10.0]; give",
        ),
        (("eval", "agent=belief", "training.microphone.silent=2"), "training.microphone.silent: 2"),
        (("train", "model=sound_cnn", "training.microphone.gain=0"), "training.microphone.gain=0"),
        (("train", "model=a3c_va", "training.microphone.gain=0"), "training.microphone.gain=0"),
        (("generate", "export=wav", "microphone.noise_rms=-1"), "microphone.noise_rms=-1"),
        (("generate", "export=wav", "clips=[[9,4]]"), "clips: [9, 4] is no [source, state] of"),
        (("generate", "export=wav", "apartments=nowhere"), "apartments: 'nowhere' is none of"),
    ],
)
def test_bad_clips_are_refused_before_anything_is_made(
    command, tmp_path, monkeypatch, arguments, said
):
    monkeypatch.chdir(tmp_path)
    assert refused_at_once(command, *arguments).partition(": ")[2].startswith(said)


def refused_at_once(command, *arguments):
    """The line of a command that is refused before anything is made."""
    code, _, err = command(*arguments, "split=mini", "outputs=made")
    assert code == 2, err
    assert err[-1].startswith(f"avn.{arguments[0]}: ")
    assert not Path("made").exists()
    return err[-1]
