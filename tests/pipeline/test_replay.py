"""Finished runs of the mini split, replayed."""

from pathlib import Path

import pandas as pd
import pytest
import torch
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf
from small import A3C, EYES, QUIET, SMALL, composed, fitting

from avn.config import saved
from avn.config.defaults import default_config
from avn.config.folder import conf_folder
from avn.config.registry import register
from avn.config.saved import read_config
from avn.core.errors import UserError
from avn.pipeline import replay
from avn.pipeline.observed import RunObservations
from avn.pipeline.run import Evaluation
from avn.pipeline.sound_network import SoundNetwork
from avn.reporting.results import write_csv


def open_run(folder):
    cfg = read_config(folder)
    return replay.open_run(folder, cfg, default_config(cfg))


def made(command, outputs, agent, *more):
    eyes = EYES if agent in ("plan_noexp", "belief") or agent.endswith("mapper") else ()
    eyes += A3C if agent.startswith("a3c") else ()
    # agents that have learnt nothing use up their actions
    settings = fitting(f"agent={agent}", *SMALL, *eyes, *QUIET, "protocol.max_actions=80")
    code, out, err = command("eval", f"agent={agent}", *settings, f"outputs={outputs}", *more)
    assert code == 0, err
    return Path(out[-1])


@pytest.mark.parametrize(
    "agent", ["random_walk", "greedy", "a3c_va_m_mapper", "plan_noexp", "plan_exp", "belief"]
)
def test_a_run_is_replayed_from_its_config(command, outputs, agent):
    folder = made(command, outputs, agent)
    run = open_run(folder)
    # nothing of the config was lost: what it makes has the same name
    assert Evaluation(run.cfg).folder == folder
    labels = [0, 3, len(run.episodes) - 1]
    traces = replay.traces(run, labels)
    for label, trace in zip(labels, traces, strict=True):
        row = run.episodes.loc[label]
        assert trace.record["row"] == label
        assert trace.state[-1] // 4 == row["end_cell"]
        assert len(trace.action) == row["actions"]
    # what an actor-critic agent hears is a feature, no place, and its map is its own affair
    assert (traces[0].source_estimates is None) == (
        agent not in ("greedy", "plan_noexp", "plan_exp")
    )
    assert (traces[0].beliefs is None) == (not agent.startswith(("plan", "belief")))
    assert (traces[0].exploration_trajectory is None) == (
        agent not in ("plan_exp", "a3c_va_m_mapper")
    )


@pytest.mark.parametrize("row", sorted(path.stem for path in (conf_folder() / "agent").iterdir()))
def test_a_config_that_was_written_and_read_makes_the_same(row):
    register()
    with initialize_config_dir(str(conf_folder()), version_base="1.3"):
        cfg = compose("eval", [f"agent={row}", "split=mini", "sound=clock", "realisations=3"])
    again = saved._typed(OmegaConf.create(OmegaConf.to_yaml(cfg, resolve=True)))
    assert OmegaConf.to_container(again) == OmegaConf.to_container(cfg, resolve=True)
    assert Evaluation(again).fingerprint == Evaluation(cfg).fingerprint


def test_the_clips_of_a_trace_are_those_that_the_network_heard(command, outputs):
    run = open_run(made(command, outputs, "greedy"))
    model = SoundNetwork(run.cfg).load()
    observations = RunObservations(run)
    for trace in replay.traces(run, [1, len(run.episodes) - 2]):
        with torch.inference_mode():
            source_estimates = model.eval()(observations.clips(trace))
        heading, here = trace.state % 4, trace.path
        right, front = source_estimates.double().unbind(1)
        east = torch.stack((right, front, -right, -front))[heading, torch.arange(len(here))]
        north = torch.stack((front, -right, -front, right))[heading, torch.arange(len(here))]
        found = here + torch.stack((east, north), dim=1).numpy()
        assert abs(found - trace.source_estimates).max() < 1e-3


def test_records_of_another_making_are_refused(command, outputs):
    folder = made(command, outputs, "greedy", "seed=3")
    path = folder / "episodes.csv"
    whole = path.read_bytes()
    run = open_run(folder)
    try:
        episodes = run.episodes.copy()
        episodes.loc[0, "end_cell"] += 1
        write_csv(episodes, path)
        with pytest.raises(UserError, match=r"the replayed episodes differ"):
            replay.traces(open_run(folder), [0])
    finally:
        path.write_bytes(whole)


def test_a_run_of_another_version_sets_off_no_training(command, outputs, monkeypatch):
    folder = made(command, outputs, "greedy")
    monkeypatch.setattr(SoundNetwork, "version", 99)
    before = set((outputs / "train").iterdir())
    with pytest.raises(UserError, match=r"made with other code.* is missing and auto=false"):
        replay.traces(open_run(folder), [0])
    assert set((outputs / "train").iterdir()) == before


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(UserError, match=r"no run's folder, it has no config.yaml"):
        open_run(tmp_path)


def episodes() -> pd.DataFrame:
    rows = [
        ("a", "ring", 1, 1.0, 0.0, 4.0),
        ("a", "ring", 1, 0.5, 0.5, 6.0),
        ("a", "clock", 0, 0.0, 3.0, 6.0),
        ("b", "ring", 1, 0.6, 0.5, 6.0),
        ("b", "ring", 0, 0.0, 9.0, 9.0),
        ("b", "clock", 1, 0.5, 0.5, 9.0),
    ]
    columns = ["scene", "sound", "success", "spl", "dtg", "geodesic"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.assign(source=0, start_cell=frame.index, start_heading=0)


def test_what_is_chosen_is_typical_and_from_everywhere():
    chosen = replay.choose(episodes(), "typical", 2)
    assert chosen[0] == 1  # of the median SPL, and as far away as most
    assert set(episodes().loc[chosen, "scene"]) == {"a", "b"}
    assert set(replay.choose(episodes(), "success", 9)) == {0, 1, 3, 5}
    assert set(replay.choose(episodes(), "failure", 9)) == {2, 4}
    assert replay.choose(episodes()[episodes()["success"] == 1], "failure", 2) == []
    assert replay.choose(episodes(), "typical", 0) == []
    with pytest.raises(UserError, match="--show: 'best' is none of typical, success, failure"):
        replay.choose(episodes(), "best", 1)


def test_a_saved_training_world_is_read_back_as_it_was(tmp_path):
    options = ["agent=greedy", "split=mini", "sound@training.sounds=ring"]
    cfg = composed(*options, "+training.sounds.mine=clock", "~training.sounds.ring")
    (tmp_path / "config.yaml").write_text(OmegaConf.to_yaml(cfg, resolve=True))
    again = read_config(tmp_path)
    assert dict(again.training.sounds) == {"mine": "clock"}
    assert Evaluation(again).fingerprint == Evaluation(cfg).fingerprint


def test_runs_of_the_same_episodes_find_them_in_each_other(command, outputs):
    one = open_run(made(command, outputs, "random_walk"))
    other = open_run(made(command, outputs, "random_walk", "seed=1"))
    third = open_run(made(command, outputs, "greedy"))
    with pytest.raises(UserError, match="has other episodes"):
        replay.same_episodes(one, [0], other)
    assert replay.same_episodes(one, [2, 0], third) == [2, 0]


def test_a_start_is_chosen_once_before_it_is_with_another_sound():
    rows = [("a", sound, 0, 0.0, 3.0, 4.0, n) for sound in ("ring", "clock") for n in range(3)]
    columns = ["scene", "sound", "success", "spl", "dtg", "geodesic", "start_cell"]
    frame = pd.DataFrame(rows, columns=columns).assign(source=0, start_heading=0)
    assert len(set(frame.loc[replay.choose(frame, "typical", 3), "start_cell"])) == 3
    assert len(replay.choose(frame, "typical", 6)) == 6
