"""Worlds that change in an episode, on the real pipeline."""

from pathlib import Path

import pandas as pd
import pytest
import torch
from small import SMALL, composed, fitting

from avn.config.defaults import default_config
from avn.config.saved import read_config
from avn.core.errors import UserError
from avn.pipeline import replay
from avn.pipeline.apartments import Apartments
from avn.pipeline.dynamics import STEADY, build_dynamics, check_dynamics
from avn.pipeline.observed import RunObservations
from avn.pipeline.run import Evaluation

ROW = "agent=greedy"


def walked(command, outputs, *options):
    settings = fitting((ROW, *options), *SMALL)
    code, out, err = command("eval", ROW, *settings, *options, f"outputs={outputs}")
    assert code == 0, err
    return out[-1]


def test_the_clips_of_a_film_are_silent_before_and_after_the_sound(command, outputs):
    times = ("schedule.begins=[2,2]", "schedule.mean=3", "schedule.deviation=0")
    folder = walked(command, outputs, "schedule=intermittent", *times)
    cfg = read_config(Path(folder))
    run = replay.open_run(Path(folder), cfg, default_config(cfg))
    longest = int(run.episodes["actions"].idxmax())
    (trace,) = replay.traces(run, [longest])
    assert len(trace.action) > 7
    level = RunObservations(run).clips(trace).square().mean((1, 2)).sqrt()
    noise = cfg.microphone.noise_rms
    sounds, tail = level[2:5], level[5]
    assert (sounds > 2 * noise).all()
    assert torch.allclose(level[:2], torch.tensor(noise), rtol=0.05)
    assert torch.allclose(level[6:], torch.tensor(noise), rtol=0.05)
    assert noise < tail < sounds.min(), "the reverberation of 0.2 s"


def test_equal_runs_have_equal_bytes(command, outputs):
    options = ("schedule=intermittent", "distractor=other_category", "odometry=noisy")
    first = walked(command, outputs, *options)
    records = (Path(first) / "episodes.csv").read_bytes()
    assert walked(command, outputs, *options, "force=true") == first
    assert (Path(first) / "episodes.csv").read_bytes() == records
    frame = pd.read_csv(Path(first) / "episodes.csv")
    assert {"sound_ends", "distractor_sound", "drift"} <= set(frame)
    results = pd.read_csv(Path(first) / "results.csv")
    assert {"sws", "drift"} <= set(results)


def test_a_steady_world_keeps_its_fingerprint_whatever_the_groups_are():
    cfg = composed(ROW)
    read = Evaluation(cfg).read()
    assert not [key for key in read if key.split(".")[0] in STEADY]
    other = composed(ROW, "schedule=intermittent")
    assert Evaluation(other).fingerprint != Evaluation(cfg).fingerprint


def test_files_of_the_user_are_categories_of_their_own():
    cfg = composed(ROW, "distractor=other_category", "+sound.hum=hum.wav", "sound=dog")
    categories = build_dynamics(cfg).distractor.categories
    assert categories["hum"] == "hum"
    assert set(categories.values()) == {"dog", "hum"}


def test_what_cannot_be_drawn_is_refused_before_anything_is_made(command, tmp_path):
    cfg = composed(ROW, "distractor=other_category", "sound=alarm", "split=mini")
    with pytest.raises(UserError, match="all sounds are of one category"):
        check_dynamics(cfg, Apartments(cfg, "test").plans)
    given = ("split=mini", "distractor=other_category", "sound=alarm", f"outputs={tmp_path}/o")
    code, _, err = command("eval", ROW, *given)
    assert code == 2
    assert len(err) == 1
    assert not [*(tmp_path / "o").glob("*")]


def test_the_truth_is_that_of_steady_sounds(command, tmp_path):
    truth = ("agent.oracle_inputs=[source_estimate]", "agent.privileged=true")
    given = ("agent=plan_noexp", *truth, "schedule=intermittent", f"outputs={tmp_path}/o")
    code, _, err = command("eval", *given)
    assert code == 2
    assert "agent.oracle_inputs: 'source_estimate' is known of steady sounds alone" in err[-1]
