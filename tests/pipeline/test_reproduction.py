"""The plan of a table: what is made once, in which order, and that nothing is left out."""

import pytest
from small import A3C, EYES, QUIET, SMALL, composed

from avn.config.spare import compose_fitting
from avn.pipeline.building import make, missing
from avn.pipeline.occupancy import OccupancyNetwork
from avn.pipeline.run import Evaluation
from avn.pipeline.trained import METRICS

ALL_ROWS = ("greedy", "a3c_va", "a3c_va_m_mapper", "plan_noexp")


@pytest.fixture
def plan(tmp_path):
    def steps(*rows, seeds=(0,), networks=(0,), options=()):
        shared = (*SMALL, *QUIET, *options, f"outputs={tmp_path}")
        return missing(
            Evaluation(
                composed(
                    f"agent={row}",
                    f"seed={seed}",
                    f"train_seed={network}",
                    *shared,
                    compose=compose_fitting,
                )
            )
            for row in rows
            for seed in seeds
            for network in networks
        )

    return steps


def names(stages):
    return [stage.title for stage in stages]


def test_each_stage_is_named_once_and_before_what_needs_it(plan, tmp_path):
    planned = plan(*ALL_ROWS, seeds=(0, 1))
    found = names(planned)
    assert len(set(found)) == len(found)
    # they come with the embeddings of the same clips
    assert not [
        title for title in found if title.startswith("source estimates by 'cnn5' in the test")
    ]
    order = [
        "sound of the train apartments of 'mini' (resonance)",
        "sound of the validation apartments of 'mini' (resonance)",
        "sound network 'cnn5' (resonance, train_seed 0)",
        "sound of the test apartments of 'mini' (resonance)",
        "audio embeddings by 'cnn5' in the test apartments of 'mini', seed 0 (eval)",
        "run of 'greedy' (seed 0, train_seed 0)",
        "run of 'greedy' (seed 1, train_seed 0)",
        "views of the test apartments of 'mini' (raycast)",
        "visual embeddings of the test apartments of 'mini' (efficientnet_lite0)",
        "agent 'a3c_va' (resonance, var, train_seed 0)",
        "run of 'a3c_va' (seed 0, train_seed 0)",
        "views of the train apartments of 'mini' (raycast, appearance 1)",
        "occupancy network 'small' (raycast, train_seed 0)",
        "agent 'a3c_va_m_mapper' (resonance, var, train_seed 0)",
        "run of 'plan_noexp' (seed 1, train_seed 0)",
    ]
    assert [found.index(name) for name in order] == sorted(found.index(name) for name in order)
    runs = [stage.cfg.agent.name for stage in planned if isinstance(stage, Evaluation)]
    assert runs == [name for name in ALL_ROWS for _ in (0, 1)]
    assert list(tmp_path.iterdir()) == []  # a plan writes nothing


def test_a_row_without_ears_needs_no_sound_and_one_without_eyes_no_views(plan):
    assert names(plan("random_walk")) == [
        "geometry of the test apartments of 'mini'",
        "run of 'random_walk' (seed 0, train_seed 0)",
    ]
    assert not [name for name in names(plan("greedy")) if "views" in name or "occupancy" in name]
    assert not [name for name in names(plan("a3c_v")) if "sound" in name]


def test_what_is_made_was_planned_and_then_nothing_is_missing(plan, capfd):
    rows, options = ("plan_noexp", "a3c_va_mapper"), (*EYES, *A3C, "sound=alarm")
    stages = plan(*rows, options=options)
    capfd.readouterr()
    for stage in stages:
        make(stage)
    said = capfd.readouterr().out.splitlines()
    made = [line.split(" is missing: ")[0] for line in said if " is missing: making it" in line]
    assert made == names(stages)
    assert plan(*rows, options=options) == []


def test_what_a_present_stage_was_made_of_is_not_asked_for(plan):
    (found,) = [stage for stage in plan("plan_noexp") if isinstance(stage, OccupancyNetwork)]
    metrics = found.folder / METRICS
    metrics.parent.mkdir(parents=True)
    metrics.touch()
    left = names(plan("plan_noexp"))
    assert not [name for name in left if "appearance 1" in name or "views of the train" in name]


def test_one_row_twice_and_one_network_for_two_train_seeds_walk_once(plan):
    twice = plan("greedy", "greedy")
    assert names(twice) == names(plan("greedy"))
    one = plan("greedy", networks=(0, 1), options=("sound_model.train_seed=0",))
    for stages in (twice, one):
        assert len([stage for stage in stages if isinstance(stage, Evaluation)]) == 1
    two = plan("greedy", networks=(0, 1))
    assert len([stage for stage in two if isinstance(stage, Evaluation)]) == 2
