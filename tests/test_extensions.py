"""Parts from outside the package: one importable file and one config file each, nothing else."""

import json
import re
import sys
from pathlib import Path

import pandas as pd
import pytest
import torch
import yaml
from small import A3C, EYES, QUIET, SMALL, fitting

from avn.acoustics.microphone import Microphone
from avn.config.cli import command
from avn.config.saved import read_config
from avn.pipeline.run import Evaluation

OWN = Path(__file__).parent / "extensions"


@pytest.fixture
def own(monkeypatch):
    """The folder of the file, and that of the config files."""
    monkeypatch.syspath_prepend(OWN)
    return OWN


@pytest.fixture
def run(own, command, outputs):

    def go(name, chosen, *options):
        where = ("--config-dir", str(own / "conf"), f"outputs={outputs}")
        shared = [*SMALL, *EYES, *A3C, *QUIET]
        if "renderer=stripes" in options:  # which has a camera and no light
            shared = [own for own in shared if not own.startswith(("renderer.l", "renderer.s"))]
        settings = fitting(chosen, *shared)
        code, out, err = command(name, *where, chosen, *settings, *options)
        assert code == 0, err
        return Path(out[-1])

    return go


def episodes(folder):
    return pd.read_csv(folder / "episodes.csv")


def test_a_sound_network_with_settings_of_its_own_feeds_an_actor_critic(run):
    folder = run("train", "model=a3c_va", "sound_model=deep", "sound_model.layers=3")
    run_folder = run("eval", "agent=a3c_va", "sound_model=deep", "sound_model.layers=3")
    cfg = read_config(run_folder)
    assert cfg.sound_model.layers == 3
    assert Evaluation(cfg).folder == run_folder  # and pictures of the run find it again
    cards = [path.read_text() for path in folder.parent.glob("sound_cnn-*/model_card.md")]
    assert any("layers: 3" in card for card in cards)


def test_an_option_on_top_of_one_of_ours_keeps_its_settings(own, monkeypatch, capfd):
    given = ("--config-dir", str(own / "conf"), "model=sound_cnn", "sound_model=deeper")
    monkeypatch.setattr(sys, "argv", ["avn.train", *given, "--cfg", "job", "-p", "sound_model"])
    assert command("train")(lambda cfg: None)() == 0
    shown = yaml.safe_load(capfd.readouterr().out)
    assert (shown["layers"], shown["net"]["output_scale"], shown["epochs"]) == (4, 10.0, 30)
    assert shown["optimizer"]["_target_"] == "torch.optim.Adadelta"


def test_an_occupancy_network(run):
    sure = run("eval", "agent=plan_noexp", "occupancy_model=patient")
    unsure = run(
        "eval", "agent=plan_noexp", "occupancy_model=patient", "occupancy_model.temperature=9.0"
    )
    assert sure != unsure


def test_a_mapper(run):
    one, other = (
        run("eval", "agent=plan_noexp", "mapper=forgetful", "occupancy_model=small", more)
        for more in ("mapper.after=1", "mapper.after=500")
    )
    assert not episodes(one).equals(episodes(other))


def test_a_planner(run):
    found = episodes(run("eval", "agent=plan_noexp", "planner=lazy", "planner.rest=6"))
    assert (found["actions"] - found["path_length"] >= 6).all()


def test_an_agent_with_settings(run):
    chosen = ("agent=random_walk", "baseline=square", "agent.name=square")
    one, other = (
        episodes(run("eval", *chosen, more))
        for more in ("baseline.side=1", "baseline.clockwise=false")
    )
    assert not one["end_cell"].equals(other["end_cell"])


def test_an_algorithm(run):
    folder = run("train", "model=a3c_va", "algorithm=reinforce", "algorithm.constant=0.5")
    curve = json.loads((folder / "curve.json").read_text())
    assert curve[-1]["steps"] == 400
    assert "return" in curve[-1]
    assert "entropy" not in curve[-1]  # of A3C alone
    walked = episodes(run("eval", "agent=a3c_va", "algorithm=reinforce"))
    assert (walked["actions"] > 0).all()


@pytest.mark.parametrize("memory", [0, 8])
def test_an_actor_critic_that_observes_depth(run, memory):
    chosen = ("baseline=depth", f"agent.name=depth_{memory}", f"baseline.memory={memory}")
    folder = run("train", "model=a3c_va", *chosen, "baseline.temperature=0.5")
    sizes = json.loads((folder / "metrics.json").read_text())["features"]
    assert set(sizes) == {"visual_embedding", "depth", "audio_embedding"}
    assert sizes["depth"] == 32 * 32
    assert (episodes(run("eval", "agent=a3c_va", *chosen))["actions"] > 0).all()


def test_an_option_without_a_name_is_named_after_its_file(run):
    found = episodes(run("eval", "agent=random_walk", "protocol=wide"))
    assert set(found["protocol"]) == {"wide"}
    assert found["geodesic"].min() >= 2.0


def test_a_protocol(run):
    strict, kind = (
        episodes(run("eval", "agent=random_walk", "protocol=near", f"protocol.within={moves}"))
        for moves in (1, 6)
    )
    # nobody begins at the goal, and it reaches six moves of half a metre far
    assert kind["geodesic"].min() > 3.0 >= strict["geodesic"].min()
    assert kind["success"].any()


def test_a_renderer(run, outputs):
    folder = run("eval", "agent=plan_noexp", "renderer=stripes", "renderer.period=2")
    assert (folder / "results.csv").is_file()
    assert list(outputs.glob("generate/room_1-*/views-stripes-*.h5"))


def test_a_condition_of_the_microphone(run):
    clean = run("eval", "agent=greedy")
    clipped = run("eval", "agent=greedy", "microphone=clipping", "microphone.limit=0.02")
    assert Evaluation(read_config(clipped)).folder == clipped
    heard = [(folder / "source_estimates.csv").read_text() for folder in (clean, clipped)]
    assert heard[0] != heard[1]


def test_a_condition_is_what_its_class_says(own):
    from own_parts import Clipping

    clips = torch.tensor([[[0.5, -0.01], [0.3, 0.0]]])
    found = Clipping(limit=0.1, noise_rms=0.0, gain=2.0).record(clips.clone(), lambda ear: None)
    torch.testing.assert_close(found, (2 * clips).clamp(-0.1, 0.1))
    assert isinstance(Clipping(), Microphone)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (("baseline=square", "baseline.sid=3"), "Key 'sid' not in 'SquareSettings'"),
        (("baseline=square", "baseline.side=long"), "could not be converted to Integer"),
        (("baseline=square", "+baseline.colour=red"), "colour"),
    ],
)
def test_a_mistake_in_them_is_one_line(own, command, outputs, options, line):
    where = ("--config-dir", str(own / "conf"), f"outputs={outputs}", "split=mini")
    code, _, err = command("eval", *where, "agent=random_walk", *options)
    assert code == 2
    assert len(err) == 1
    assert line in err[0]


def test_a_class_that_cannot_be_imported_is_one_line(own, command, outputs, tmp_path):
    (tmp_path / "baseline").mkdir()
    (tmp_path / "baseline" / "gone.yaml").write_text("_target_: nowhere.Gone\n")
    for folder, line in ((tmp_path, "nowhere.Gone"), (tmp_path / "none", "is no folder")):
        where = ("--config-dir", str(folder), f"outputs={outputs}", "split=mini")
        code, _, err = command("eval", *where, "agent=random_walk", "baseline=gone")
        assert code == 2
        assert len(err) == 1
        assert line in err[0]


LACKING = {
    "sound_model": ("features", "prepare"),
    "stop_model": ("log_odds", "prepare"),
    "occupancy_model": ("log_odds", "prepare"),
    "mapper": ("observe", "reset"),
    "planner": ("act", "reset"),
    "baseline": ("act", "reset"),
    "algorithm": ("build_loss",),
    "protocol": ("goal_cells", "judge"),
    "microphone": ("record",),
    "schedule": ("draw",),
    "distractor": ("check", "draw"),
    "odometry": ("failures",),
    "motion": ("walk",),
    "renderer": ("prepare", "views"),
    "backbone": ("pooled",),
}


@pytest.mark.parametrize("group", LACKING)
def test_a_class_that_lacks_methods_of_its_kind_is_one_line(own, command, tmp_path, group):
    (tmp_path / group).mkdir()
    (tmp_path / group / "plain.yaml").write_text("_target_: own_parts.PlainModule\n")
    where = ("--config-dir", str(tmp_path), f"outputs={tmp_path / 'outputs'}", "split=mini")
    code, _, err = command("eval", *where, "agent=random_walk", f"{group}=plain")
    assert code == 2
    assert len(err) == 1
    assert f"{group}._target_: class own_parts.PlainModule lacks" in err[0]
    assert all(name in err[0] for name in LACKING[group])
    assert "derive it from avn." in err[0]
    assert not (tmp_path / "outputs").exists()


@pytest.mark.parametrize(
    ("target", "line"),
    [
        ("NoActions", "class own_parts.NoActions lacks act"),
        ("make_agent", "make_agent is a function and no class"),
    ],
)
def test_an_unfinished_class_and_a_function_are_one_line(own, command, tmp_path, target, line):
    (tmp_path / "baseline").mkdir()
    (tmp_path / "baseline" / "half.yaml").write_text(f"_target_: own_parts.{target}\n")
    where = ("--config-dir", str(tmp_path), f"outputs={tmp_path}", "split=mini")
    code, _, err = command("eval", *where, "agent=random_walk", "baseline=half")
    assert code == 2
    assert len(err) == 1
    assert line in err[0]


@pytest.mark.parametrize(
    ("target", "line"),
    [
        ("SmellCritic", "agent SmellCritic needs the observation 'smell'; there are .*depth"),
        ("WaveCritic", "agent WaveCritic needs the observation 'waveform', which is rendered"),
    ],
)
def test_an_actor_critic_that_wants_what_cannot_be_is_one_line(
    own, command, tmp_path, target, line
):
    (tmp_path / "baseline").mkdir()
    (tmp_path / "baseline" / "critic.yaml").write_text(f"_target_: own_parts.{target}\n")
    where = ("--config-dir", str(tmp_path), f"outputs={tmp_path / 'outputs'}", "split=mini")
    code, _, err = command("train", *where, "model=a3c_v", "baseline=critic")
    assert code == 2
    assert len(err) == 1
    assert re.search(line, err[0])
