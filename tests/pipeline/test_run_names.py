"""Names of runs."""

from pathlib import Path

import pandas as pd
from small import composed

from avn.config.defaults import default_config
from avn.pipeline.replay import Run
from avn.pipeline.run_names import names_of, settings_but_seed


def run(*overrides, folder="seed0-00000000"):
    cfg, frame = composed(*overrides), pd.DataFrame()
    return Run(Path(folder), cfg, frame, frame, default_config(cfg))


def names(*runs):
    return names_of([run(*overrides.split()) for overrides in runs])


def test_agents_are_enough_where_they_differ():
    assert names("agent=greedy", "agent=random_walk") == ["greedy", "random_walk"]
    # what all runs share, and what only one of them reads
    shared = "acoustics.rays=300 acoustics=diffraction split=mini"
    assert names(f"agent=greedy {shared}", f"agent=random_walk {shared}") == [
        "greedy",
        "random_walk",
    ]


def test_a_setting_is_named_where_it_is_read_and_not_that_of_the_row():
    assert names(
        "agent=greedy localisation=retrieval look=around",
        "agent=plan_exp localisation=retrieval",
        "agent=plan_exp",
        "agent=plan_exp look=around",
    ) == ["greedy", "plan_exp, localisation=retrieval", "plan_exp", "plan_exp, look=around"]


def test_an_option_stands_for_its_settings_and_a_change_for_itself():
    assert names(
        "agent=greedy protocol=stop acoustics=diffraction",
        "agent=greedy protocol.max_moves_ratio=3",
        "agent=greedy",
    ) == [
        "greedy, acoustics=diffraction, protocol=stop",
        "greedy, protocol.max_moves_ratio=3.0",
        "greedy",
    ]


def test_what_changes_in_an_episode_is_named():
    assert names(
        "agent=greedy schedule=intermittent",
        "agent=greedy schedule=intermittent odometry=noisy",
        "agent=greedy",
    ) == [
        "greedy, schedule=intermittent",
        "greedy, schedule=intermittent, odometry=noisy",
        "greedy",
    ]
    assert names("agent=greedy odometry=noisy", "agent=greedy odometry=noisy odometry.slip=0") == [
        "greedy",
        "greedy, odometry.slip=0.0",
    ]


def test_seeds_and_sounds_are_named_where_they_differ():
    assert names("agent=greedy seed=0", "agent=greedy seed=1") == [
        "greedy, seed=0",
        "greedy, seed=1",
    ]
    assert names("agent=greedy train_seed=1", "agent=greedy", "agent=random_walk") == [
        "greedy, train_seed=1",
        "greedy, train_seed=0",
        "random_walk",
    ]
    assert names("agent=greedy sound=ring", "agent=greedy") == [
        "greedy, sound=ring",
        "greedy, sound=ring+alarm+clock",
    ]


def test_other_settings_are_named_where_nothing_else_tells_runs_apart():
    assert names("agent=plan_noexp planner.collision_cost=9", "agent=plan_noexp") == [
        "plan_noexp, planner.collision_cost=9.0",
        "plan_noexp",
    ]
    same = [run("agent=greedy", folder=name) for name in ("seed0-a", "seed0-b")]
    assert names_of(same) == ["greedy (seed0-a)", "greedy (seed0-b)"]


def test_runs_of_several_seeds_have_the_same_other_settings():
    one, other = run("agent=greedy"), run("agent=greedy", "seed=1", "film=2", "processes=1")
    assert settings_but_seed(one) == settings_but_seed(other)
    assert settings_but_seed(one) != settings_but_seed(run("agent=greedy", "train_seed=1"))
