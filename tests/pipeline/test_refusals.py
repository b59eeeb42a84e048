"""Settings that cannot work are refused before anything is made."""

import re

import pytest
from small import composed

from avn.core.errors import UserError
from avn.pipeline.building import missing
from avn.pipeline.occupancy import OccupancyNetwork
from avn.pipeline.policy import Policy
from avn.pipeline.run import Evaluation
from avn.pipeline.sound_network import SoundNetwork
from avn.pipeline.stop_classifier import StopNetwork


@pytest.mark.parametrize(
    ("overrides", "line"),
    [
        (("agent=a3c_va_m", "episodes=exhaustive"), "have no exploration walk"),
        (("agent=plan_exp", "protocol.exploration_steps=0"), "have no exploration walk"),
        (
            ("agent=plan_noexp", "agent.oracle_inputs=[pose]", "agent.privileged=true"),
            "'pose' is nothing",
        ),
        (
            ("agent=plan_exp", "agent.oracle_inputs=[map]", "agent.privileged=true"),
            "'map' is nothing",
        ),
        (
            ("agent=plan_exp", "agent.oracle_inputs=[local_patch]", "agent.privileged=true"),
            "'local_patch' is noth",
        ),
        (("agent=plan_noexp", "mapper.size=100"), "mapper.size: 100; give an odd number"),
        (("agent=plan_noexp", "protocol=stop", "stop_model.criterion=foo"), "stop_model.criterion"),
        (("agent=a3c_va_mapper", "baseline.map_width=20"), "baseline.map_width: 20"),
        (("agent=greedy", "sound_model.epochs=0"), "epochs"),
        (("agent=plan_noexp", "sound_model.schedule=foo"), "schedule"),
        (("agent=plan_noexp", "occupancy_model.appearances=0"), "occupancy_model.appearances: 0"),
        (("agent=greedy", "realisations=0"), "realisations: 0 is out of range"),
        (("agent=greedy", "trainer.devices=2"), "trainer.devices: 2"),
        (("agent=greedy", "trainer.precision=half"), "trainer.precision: 'half'"),
        (("agent=greedy", "sound_model.ckpt_path=nowhere"), "nowhere: no such file"),
        (("agent=a3c_v", "algorithm.ckpt_path=nowhere"), "nowhere: no such file"),
        (("agent=a3c_v", "logger=csv", "+logger.csv.foo=1"), "logger.csv.foo: no such setting"),
        (("agent=greedy", "callbacks=timer", "+callbacks.timer.foo=1"), "callbacks.timer.foo: no"),
    ],
)
def test_what_cannot_work_is_refused_before_anything_is_made(overrides, line, tmp_path):
    run = Evaluation(composed("split=mini", f"outputs={tmp_path}", *overrides))

    def plan():
        run.check()
        missing([run])

    with pytest.raises(UserError, match=re.escape(line)):
        plan()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("kind", "line"),
    [
        (SoundNetwork, "sound_model: 'none' cannot hear; choose cnn5 or released"),
        (StopNetwork, "stop_model: 'none' cannot say Stop; choose cnn5"),
        (OccupancyNetwork, "occupancy_model: 'none' sees no free cells; choose small or released"),
        (Policy, "baseline: that of agent 'random_walk' is no actor-critic"),
    ],
)
def test_what_a_config_does_not_have_is_refused(kind, line):
    with pytest.raises(UserError, match=line):
        kind(composed("agent=random_walk")).check()
