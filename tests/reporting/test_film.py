import re
import subprocess
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
import torch
from drawn_walks import FLAT, clips, hearing, ours, views, walked

from avn.agents.random_walk import RandomWalk
from avn.core.errors import UserError
from avn.core.sound_mix import SoundMix
from avn.navigation.navigation_scene import draw
from avn.navigation.trace import Trace
from avn.pipeline.observed import soundtrack
from avn.reporting.film import FPS, SIZE, frames, write_film


def shown(path: Path) -> np.ndarray:
    """All pictures of a film, (N, H, W, 3)."""
    reader = imageio_ffmpeg.read_frames(str(path))
    size = next(reader)["size"]
    return np.stack([np.frombuffer(own, np.uint8).reshape(size[1], size[0], 3) for own in reader])


def played(path: Path) -> np.ndarray:
    """A film's sound at 16 kHz as it is stored, (n, channels)."""
    exe = imageio_ffmpeg.get_ffmpeg_exe()
    told = subprocess.run([exe, "-i", str(path)], capture_output=True, text=True).stderr
    channels = {"stereo": 2, "mono": 1}[re.search(r"Audio: aac.* Hz, (\w+)", told)[1]]
    command = [exe, "-loglevel", "error", "-i", str(path), "-f", "s16le", "-ar", "16000", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(raw, "<i2").reshape(-1, channels) / 32768


def film(path: Path, trace: Trace) -> Path:
    heard_clips = clips(trace)
    write_film(path, trace, "ours", views(trace), heard_clips, soundtrack(heard_clips))
    return path


def test_a_film_has_a_second_for_each_step_and_two_ears(tmp_path: Path) -> None:
    trace = min(walked(ours()), key=lambda own: len(own.action))
    path = film(tmp_path / "own.mp4", trace)
    seconds = len(trace.action) + 1
    pictures, sound = shown(path), played(path)
    assert pictures.shape == (FPS * seconds, SIZE[1], SIZE[0], 3)
    assert len(sound) / 16000 == pytest.approx(seconds, abs=0.1)
    assert sound.shape[1] == 2
    left, right = np.sqrt((sound**2).mean(axis=0))
    assert right / left == pytest.approx(4, rel=0.05)  # the right ear stays the right one
    # the view of each step is what the agent sees there, in the upper left corner
    for step in range(seconds):
        seen = pictures[FPS * step + 2, 200:300, 200:300].mean(axis=(0, 1))
        assert np.abs(seen - views(trace)[step, 0, 0]).max() < 25
    # the cursor moves within a second, and the agent between seconds
    assert (pictures[0] != pictures[2]).any()
    assert not list(tmp_path.glob(".*"))


def test_the_posterior_is_on_the_map_at_each_step() -> None:
    trace = min(walked(hearing()), key=lambda own: len(own.action))
    assert trace.beliefs is not None
    plain = replace(trace, beliefs=replace(trace.beliefs, posterior=None))
    dots, none = (
        np.stack([*frames(own, "belief", views(own), clips(own))])[::FPS, 110:640, 490:].astype(int)
        for own in (trace, plain)
    )
    changed = np.abs(dots - none).any(-1)
    assert changed.any((1, 2)).all()
    assert (changed[0] != changed[-1]).any(), "the dots move"


def test_a_distractor_is_on_the_map() -> None:
    scene = draw("flat", FLAT.replace("a", "A", 1))
    steady = SoundMix.steady(100)
    mixed = steady._replace(other_source=torch.ones(100, dtype=torch.int64))
    trace = replace(walked(ours(), [0])[0], scene=scene)
    assert trace.goal.tolist() == [6.5, 1.5], "the place of the source is the same in this flat"
    shown, plain = (
        next(frames(replace(trace, mix=mix), "ours", views(trace), clips(trace)))
        for mix in (mixed.rows(slice(len(trace.state))), steady.rows(slice(len(trace.state))))
    )
    rows, columns = (shown != plain).any(-1)[100:650, 490:].nonzero()
    assert rows.size
    assert rows.mean() < 225, "it is in the north"
    assert columns.mean() < 390, "and in the west"


def test_an_agent_without_ears_or_map_is_filmed_too(tmp_path: Path) -> None:
    trace = min(walked(RandomWalk()), key=lambda own: len(own.action))
    deaf = type(trace)(**{**vars(trace), "source_estimates": None})
    pictures = shown(film(tmp_path / "own.mp4", deaf))
    assert len(pictures) == FPS * len(trace.state)


def test_the_seconds_of_a_soundtrack_meet_without_a_click() -> None:
    trace = walked(ours(), [0])[0]
    heard_clips = clips(trace)[:4]
    heard_clips[1:] *= -0.5
    track = soundtrack(heard_clips)
    assert track.shape == (4 * 16000, 2)
    assert np.abs(track).max() == pytest.approx(0.9)
    hard = heard_clips.permute(0, 2, 1).reshape(-1, 2).numpy()
    factor = 0.9 / np.abs(hard).max()
    steps = np.abs(np.diff(track, axis=0)).max()
    assert steps <= factor * np.abs(np.diff(heard_clips.numpy(), axis=-1)).max() + 0.02


def test_a_film_that_cannot_be_written_is_one_line(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", "/bin/false")
    trace = walked(ours(), [0])[0]
    with pytest.raises(UserError, match=r"own.mp4: the film cannot be encoded"):
        film(tmp_path / "own.mp4", trace)
    assert not list(tmp_path.iterdir())
