"""The paper's benchmark, and the world of a run in words."""

import numpy as np
import pytest
import soundfile
from small import composed

from avn.config.defaults import default_config
from avn.pipeline.benchmark import (
    caption_of,
    changed_settings,
    describe_world,
    note_of,
    paper_sounds,
    paper_sounds_by_agent,
)

WHOLE = {"ring", "alarm", "clock", "all"}


def sounds(*overrides):
    cfg = composed(*overrides)
    return paper_sounds(cfg, default_config(cfg))


@pytest.mark.parametrize("agent", ["random_walk", "greedy", "a3c_v", "plan_noexp", "plan_exp"])
def test_the_default_settings_are_the_benchmark_whatever_the_seeds(agent):
    assert sounds(f"agent={agent}") == WHOLE
    assert sounds(f"agent={agent}", "seed=3", "train_seed=2", "film=4", "processes=1") == WHOLE


def test_the_average_belongs_to_the_papers_three_sounds():
    assert sounds("agent=greedy", "sound=ring") == {"ring"}
    assert sounds("agent=greedy", "~sound.ring") == {"alarm", "clock"}
    assert sounds("agent=greedy", "+sound.beep=ring") == {"ring", "alarm", "clock"}
    assert sounds("agent=greedy", "sound.ring=clock") == {"alarm", "clock"}


@pytest.mark.parametrize(
    "override",
    [
        "split=mini",
        "split=procedural",
        "split.name=mine",
        "split.folder=my_flat",
        "subset=validation",
        "episodes=exhaustive",
        "protocol=stop",
        "protocol.max_moves_ratio=3",
        "protocol.num_starts=4",
        "acoustics=diffraction",
        "acoustics.rays=500",
        "microphone.gain=0.5",
        "microphone@training.microphone=default training.microphone.gain=2",
        "sound@training.sounds=ring",
        "realisations=1",
        "sound_model.epochs=1",
        "planner.collision_cost=9",
        "planner.obstacle_threshold=0.5",
        "look=around",
        "agent.name=mine",
        "occupancy_model=released",
    ],
)
def test_a_change_that_the_agent_reads_leaves_the_benchmark(override, tmp_path):
    if "my_flat" in override:
        import shutil

        from avn.apartments.splits import FROZEN

        shutil.copytree(FROZEN / "var", tmp_path / "my_flat")
        override = f"split.folder={tmp_path}/my_flat"
    assert sounds("agent=plan_noexp", *override.split()) == frozenset()


def test_a_change_that_the_agent_does_not_read_is_none():
    assert sounds("agent=greedy", "look=around", "localisation=retrieval") == WHOLE
    assert sounds("agent=random_walk", "microphone.gain=0.5", "realisations=1") == WHOLE


def test_another_algorithm_is_another_agent():
    assert sounds("agent=a3c_v", "algorithm.total_steps=5000") == frozenset()
    assert sounds("agent=a3c_va", "baseline.width=64") == frozenset()


def test_all_runs_of_an_agent_must_belong():
    configs = [composed("agent=greedy"), composed("agent=greedy", "protocol.max_moves_ratio=3")]
    configs.append(composed("agent=random_walk", "sound=ring"))
    found = paper_sounds_by_agent(configs, [default_config(cfg) for cfg in configs])
    assert found == {"greedy": frozenset(), "random_walk": {"ring"}}


def world(*overrides):
    cfg = composed(*overrides)
    return describe_world(cfg, default_config(cfg))


def test_the_world_is_named_with_what_was_changed(tmp_path):
    assert world("agent=greedy", "acoustics=diffraction", "protocol=stop") == (
        "acoustics diffraction; protocol stop; sounds ring, alarm, clock (heard in training); "
        "test apartments of var"
    )
    assert "protocol var with max_moves_ratio=3.0;" in world(
        "agent=random_walk", "protocol.max_moves_ratio=3"
    )
    assert "microphone with gain=0.5" in world("agent=greedy", "microphone.gain=0.5")
    noisy = world("agent=greedy", "microphone=white", "microphone.snr=[3,3]")
    assert "microphone with class=DiffuseNoiseMicrophone, " in noisy
    assert "snr=[3.0, 3.0]" in noisy
    assert world("agent=greedy", "subset=validation").endswith("validation apartments of var")
    other = world(
        "agent=greedy", "acoustics=diffraction", "+acoustics@training.acoustics=resonance"
    )
    assert "acoustics diffraction (networks trained in resonance)" in other
    heads = ("agent=greedy", "acoustics.head=kemar")
    assert world(*heads).startswith("acoustics resonance with head=kemar; ")
    assert world(*heads, "+acoustics@training.acoustics=resonance").startswith(
        "acoustics resonance with head=kemar (networks trained in resonance with head=ku100); "
    )
    assert "training" not in world("agent=random_walk")  # it has no network
    changing = world("agent=random_walk", "schedule=intermittent", "schedule.mean=30")
    assert "; schedule intermittent with mean=30.0; test apartments" in changing


@pytest.mark.parametrize(
    "option",
    ["schedule=intermittent", "distractor=other_category", "odometry=noisy", "motion=walking"],
)
def test_the_papers_results_do_not_stand_beside_a_world_that_changes(option):
    cfg = composed("agent=random_walk", option)
    assert not paper_sounds(cfg, default_config(cfg))


def test_sounds_not_heard_in_training_are_named(tmp_path):
    soundfile.write(tmp_path / "bark.wav", np.sin(np.arange(16000)), 16000)
    found = world("agent=greedy", f"+sound.bark={tmp_path}/bark.wav")
    assert "sounds ring, alarm, clock (heard in training); sounds bark (not heard" in found
    assert "sounds alarm, clock (not heard in training)" in world(
        "agent=greedy", "sound@training.sounds=ring"
    )


def test_results_of_mini_say_that_they_mean_nothing():
    assert note_of(composed("agent=greedy")) == ""
    for overrides in (["split=mini"], ["+split@training.scenes=mini"]):
        cfg = composed("agent=greedy", *overrides)
        assert "its figures mean nothing" in note_of(cfg)
        assert note_of(cfg) in caption_of(cfg, default_config(cfg)).splitlines()


def test_what_was_changed_is_listed_once():
    cfg = composed("agent=plan_noexp", "acoustics.rays=300", "planner.collision_cost=9")
    assert changed_settings(cfg, default_config(cfg)) == {
        "acoustics.rays": "300",
        "planner.collision_cost": "9.0",
    }
