"""A source that walks, on the real pipeline: what is heard of it, runs, films and refusals."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from small import SMALL, composed, fitting

from avn.config.defaults import default_config
from avn.config.saved import read_config
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.sound_mix import SoundMix
from avn.integrations.world import open_world
from avn.pipeline import replay
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.building import build
from avn.pipeline.observations import Observed
from avn.pipeline.observed import RunObservations
from avn.pipeline.rendered_audio import Waveforms
from avn.pipeline.scenes import DirectSound, heard_sound

ROW, WALKING = "agent=greedy", "motion=walking"
TRUTH = ("agent.oracle_inputs=[source_estimate]", "agent.privileged=true")


def config(outputs, *options):
    return composed(ROW, *fitting((ROW, *options), *SMALL), *options, f"outputs={outputs}")


def walked(command, outputs, *options):
    settings = fitting((ROW, *options), *SMALL)
    code, out, err = command("eval", ROW, *settings, *options, f"outputs={outputs}")
    assert code == 0, err
    return Path(out[-1])


@pytest.fixture(scope="module")
def sounds(outputs):
    """The apartment with the responses of its sources, and with those of each square."""
    cfg = config(outputs, WALKING)
    stages = [DirectSound(cfg, Apartments(cfg, "test")), heard_sound(cfg, Apartments(cfg, "test"))]
    for stage in stages:
        build(stage)
    return [stage.load()[0] for stage in stages]


def test_a_square_has_the_response_of_a_source_that_stays_there(sounds):
    still, walking = sounds
    sources, cells = len(still.sources), still.grid.cells
    state = torch.arange(4 * cells)
    for source, cell in enumerate(still.sources):
        expected = still.brirs.gather(torch.full_like(state, source), state)
        for place in (source, sources + int(cell)):
            found = walking.brirs.gather(torch.full_like(state, place), state)
            assert torch.equal(found, expected)
    every = sources + torch.arange(cells)
    level = walking.brirs.gather(every, 4 * torch.arange(cells)).square().sum((1, 2))
    assert (level > 0).all()


def test_only_the_test_world_walks(outputs):
    cfg = config(outputs, WALKING)
    assert heard_sound(cfg, Apartments(cfg, "test")).squares
    assert not heard_sound(cfg, Apartments(cfg, "test", TRAINING)).squares
    assert not heard_sound(config(outputs), Apartments(cfg, "test")).squares


def test_a_second_after_a_step_is_from_here_and_its_tail_from_before(outputs, sounds):
    cfg = config(outputs, WALKING)
    stage = Waveforms(cfg, Apartments(cfg, "test"), Observed(Apartments(cfg, "test"), ()).clips)
    build(stage)
    (clips,) = stage.load()
    scene, count = sounds[1], 8
    state = torch.full((count,), 9)
    own = torch.arange(count)
    clip = ClipId(torch.zeros_like(own), state, own % 2, own // 2 % 2)
    here, there = (torch.full((count,), len(scene.sources) + cell) for cell in (3, 1))
    stays, moved = (
        clips.at_ears(clip, SoundMix.steady(count)._replace(place=here, place_before=before))
        for before in (here, there)
    )
    now, past = (scene.brirs.gather(place, state).double().numpy() for place in (here, there))
    stays, moved = stays.double().numpy(), moved.double().numpy()
    rate, taps = stays.shape[-1], now.shape[-1]
    # the dry second, by division of the spectrum of the steady sound by that of the response
    dry = np.fft.irfft(np.fft.rfft(stays[:, 0]) / np.fft.rfft(now[:, 0], rate), rate)
    for one, ear in np.ndindex(count, 2):
        expected = np.convolve(dry[one], now[one, ear])[:rate]
        expected[: taps - 1] += np.convolve(dry[one], past[one, ear])[rate:]
        np.testing.assert_allclose(moved[one, ear], expected, atol=2e-3 * stays.std())
    # behind the tail of before, nothing else is heard
    np.testing.assert_allclose(moved[..., taps:], stays[..., taps:], atol=1e-4 * stays.std())
    assert np.abs(moved[..., :taps] - stays[..., :taps]).max() > 0.05 * stays.std()


def test_with_probability_0_it_is_the_run_of_a_source_that_stays(command, outputs):
    one_sound = "episodes=one_sound"
    still = pd.read_csv(walked(command, outputs, one_sound) / "episodes.csv")
    walking = pd.read_csv(
        walked(command, outputs, one_sound, WALKING, "motion.step=0") / "episodes.csv"
    )
    pd.testing.assert_frame_equal(walking[still.columns], still)
    assert {*walking} - {*still} == {"source_end_cell", "fewest_actions_to_catch", "dspl", "ndtg"}


def test_a_film_hears_and_shows_the_source_where_it_is(command, outputs):
    folder = walked(command, outputs, WALKING, "motion.step=0.8")
    results = pd.read_csv(folder / "results.csv")
    assert {"dspl", "ndtg", "dspl_low", "ndtg_high"} <= {*results}
    cfg = read_config(folder)
    run = replay.open_run(folder, cfg, default_config(cfg))
    longest = int(run.episodes["actions"].idxmax())
    (trace,) = replay.traces(run, [longest])
    row, centres = run.episodes.loc[longest], trace.scene.grid.centres
    assert (trace.goals[0] == centres[row["source_cell"]]).all()
    assert (trace.goals[-1] == centres[row["source_end_cell"]]).all()
    steps = np.abs(np.diff(trace.goals, axis=0)).sum(1)
    assert set(steps.tolist()) == {0.0, 0.5}
    clips = RunObservations(run).clips(trace)
    assert clips.shape[0] == len(trace.goals)


def test_equal_runs_have_equal_bytes(command, outputs):
    options = (WALKING, "schedule=intermittent", "distractor=other_category", "odometry=noisy")
    first = walked(command, outputs, *options)
    records = (first / "episodes.csv").read_bytes()
    assert walked(command, outputs, *options, "force=true") == first
    assert (first / "episodes.csv").read_bytes() == records
    metrics = {"sws", "drift", "dspl", "ndtg"}
    assert metrics <= {*pd.read_csv(first / "results.csv")}


@pytest.mark.parametrize(
    ("name", "options", "line"),
    [
        ("eval", (ROW, WALKING, "motion.step=1.5"), "motion.step: 1.5; give a probability"),
        ("eval", (ROW, "motion.step=0.1"), "motion.step"),
        (
            "eval",
            ("agent=plan_noexp", WALKING, *TRUTH),
            "known of steady sounds alone; take schedule=continuous, distractor=none and motion=st",
        ),
        ("train", ("model=sound_cnn", WALKING), "motion"),
        ("train", ("model=a3c_va", WALKING), "motion"),
    ],
)
def test_what_cannot_work_is_one_line(command, tmp_path, name, options, line):
    code, _, err = command(name, *options, "split=mini", f"outputs={tmp_path}/o")
    assert code == 2
    assert len(err) == 1
    assert line in err[0]
    assert not [*(tmp_path / "o").glob("*")]


def test_environments_of_other_libraries_refuse_it():
    with pytest.raises(UserError, match="motion"):
        open_world([WALKING, "split=mini"], "test", ["waveform"])
