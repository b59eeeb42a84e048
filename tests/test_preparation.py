"""The plan of a reproduction: what is made once, in which order, and that nothing is left out."""

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from small import A3C, EYES, SMALL

from avn import config, preparation
from avn.cli import conf_folder

ALL_ROWS = ("greedy", "a3c_va", "a3c_va_m_mapper", "ours_noexp")


@pytest.fixture
def plan(tmp_path):
    GlobalHydra.instance().clear()
    config.register()
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):

        def steps(*rows, seeds=(0,), options=()):
            shared = (*SMALL, *options, f"outputs={tmp_path}")
            runs = [[f"agent={row}", f"seed={seed}", *shared] for row in rows for seed in seeds]
            return preparation.steps([compose("eval", overrides=run) for run in runs])

        yield steps


def names(steps):
    return [step.stage.what for step in steps]


def test_each_stage_is_named_once_and_before_what_needs_it(plan):
    planned = plan(*ALL_ROWS, seeds=(0, 1))
    found = names(planned)
    assert len(set(found)) == len(found)
    assert all(step.stage.missing and step.stage.seconds > 0 for step in planned)
    order = [
        "sound of the train, validation, test apartments of 'mini' (resonance)",
        "sound network 'cnn5' (resonance, train_seed 0)",
        # with it come the estimates that the next one asks for
        "sound features by 'cnn5' in room_1",
        "what 'cnn5' hears in room_1",
        "run of 'greedy' (seed 0, train_seed 0)",
        "run of 'greedy' (seed 1, train_seed 0)",
        "views of the train, validation, test apartments of 'mini' (raycast)",
        "agent 'a3c_va' (resonance, var, train_seed 0)",
        "run of 'a3c_va' (seed 0, train_seed 0)",
        "occupancy network 'small' (raycast, train_seed 0)",
        "what occupancy network 'small' sees in room_1",
        "agent 'a3c_va_m_mapper' (resonance, var, train_seed 0)",
        "run of 'ours_noexp' (seed 1, train_seed 0)",
    ]
    assert [found.index(name) for name in order] == sorted(found.index(name) for name in order)
    assert [step.run.agent.name for step in planned if step.run is not None] == [
        name for name in ALL_ROWS for _ in (0, 1)
    ]


def test_a_row_without_ears_needs_no_sound_and_one_without_eyes_no_views(plan):
    assert names(plan("random_walk")) == ["run of 'random_walk' (seed 0, train_seed 0)"]
    assert not [name for name in names(plan("greedy")) if "views" in name or "windows" in name]
    assert not [name for name in names(plan("a3c_v")) if "sound" in name]


def test_what_is_made_was_planned_and_then_nothing_is_missing(plan, capfd):
    rows, options = ("ours_noexp", "a3c_va_mapper"), (*EYES, *A3C, "sound=alarm")
    steps = plan(*rows, options=options)
    capfd.readouterr()
    for step in steps:
        step.make()
    said = capfd.readouterr().out.splitlines()
    made = [line.split(" is missing: ")[0] for line in said if " is missing: making it" in line]
    # the looks of the training apartments are a part of training; what is found made is not said
    assert [name for name in made if "looks" not in name] == [
        name for name in names(steps) if name != "what 'cnn5' hears in room_1"
    ]
    assert not any(step.stage.missing for step in plan(*rows, options=options))
