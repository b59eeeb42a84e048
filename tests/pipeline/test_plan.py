"""The plan of a reproduction: what is made once, in which order, and that nothing is left out."""

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from small import A3C, EYES, SMALL

from avn.config import schema
from avn.config.folder import conf_folder
from avn.pipeline.plan import steps as plan_steps
from avn.pipeline.trained import METRICS

ALL_ROWS = ("greedy", "a3c_va", "a3c_va_m_mapper", "ours_noexp")


@pytest.fixture
def plan(tmp_path):
    GlobalHydra.instance().clear()
    schema.register()
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):

        def steps(*rows, seeds=(0,), networks=(0,), options=()):
            shared = (*SMALL, *options, f"outputs={tmp_path}")
            runs = [
                [f"agent={row}", f"seed={seed}", f"train_seed={network}", *shared]
                for row in rows
                for seed in seeds
                for network in networks
            ]
            return plan_steps([compose("eval", overrides=run) for run in runs])

        yield steps


def names(steps):
    return [step.stage.what for step in steps]


def test_each_stage_is_named_once_and_before_what_needs_it(plan):
    planned = plan(*ALL_ROWS, seeds=(0, 1))
    found = names(planned)
    assert len(set(found)) == len(found)
    assert "what 'cnn5' hears in room_1" not in found
    assert all(step.stage.missing and step.stage.seconds > 0 for step in planned)
    order = [
        "sound of the test apartments of 'mini' (resonance)",
        "sound of the train apartments of 'mini' (resonance)",
        "sound of the validation apartments of 'mini' (resonance)",
        "sound network 'cnn5' (resonance, train_seed 0)",
        # with it come the estimates that the next one needs
        "sound features by 'cnn5' in room_1",
        "run of 'greedy' (seed 0, train_seed 0)",
        "run of 'greedy' (seed 1, train_seed 0)",
        "features of the train views (efficientnet_lite0)",
        "agent 'a3c_va' (resonance, var, train_seed 0)",
        "views of the test apartments of 'mini' (raycast)",
        "run of 'a3c_va' (seed 0, train_seed 0)",
        "2 looks of the train apartments of 'mini' (raycast)",
        "occupancy network 'small' (raycast, train_seed 0)",
        "agent 'a3c_va_m_mapper' (resonance, var, train_seed 0)",
        "what occupancy network 'small' sees in room_1",
        "run of 'ours_noexp' (seed 1, train_seed 0)",
    ]
    assert [found.index(name) for name in order] == sorted(found.index(name) for name in order)
    assert [step.run.agent.name for step in planned if step.run is not None] == [
        name for name in ALL_ROWS for _ in (0, 1)
    ]


def test_a_row_without_ears_needs_no_sound_and_one_without_eyes_no_views(plan):
    assert names(plan("random_walk")) == ["run of 'random_walk' (seed 0, train_seed 0)"]
    assert not [name for name in names(plan("greedy")) if "views" in name or "occupancy" in name]
    assert not [name for name in names(plan("a3c_v")) if "sound" in name]


def test_what_is_made_was_planned_and_then_nothing_is_missing(plan, capfd):
    rows, options = ("ours_noexp", "a3c_va_mapper"), (*EYES, *A3C, "sound=alarm")
    steps = plan(*rows, options=options)
    capfd.readouterr()
    for step in steps:
        step.make()
    said = capfd.readouterr().out.splitlines()
    made = [line.split(" is missing: ")[0] for line in said if " is missing: making it" in line]
    assert made == names(steps)
    assert not any(step.stage.missing for step in plan(*rows, options=options))


def test_what_a_present_stage_was_made_of_is_not_asked_for(plan, tmp_path):
    (found,) = [step for step in plan("ours_noexp") if "occupancy network" in step.stage.what[:20]]
    metrics = found.stage.folder / METRICS
    metrics.parent.mkdir(parents=True)
    metrics.touch()
    left = names(plan("ours_noexp"))
    assert not [name for name in left if "looks" in name or "views of the train" in name]


def test_one_row_twice_and_one_network_for_two_train_seeds_walk_once(plan):
    twice = plan("greedy", "greedy")
    assert names(twice) == names(plan("greedy"))
    one = plan("greedy", networks=(0, 1), options=("sound_model.train_seed=0",))
    for steps in (twice, one):
        assert len([step for step in steps if step.run is not None]) == 1
    two = plan("greedy", networks=(0, 1))
    assert len([step for step in two if step.run is not None]) == 2
