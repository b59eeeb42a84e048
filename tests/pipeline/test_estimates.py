"""Expected durations of stages."""

import platform

import pytest
from small import composed

from avn.pipeline.building import missing
from avn.pipeline.estimates import SPEEDS, expected, record
from avn.pipeline.run import Evaluation
from avn.pipeline.sound_network import SoundNetwork


def test_durations_of_this_machine_correct_the_estimates(tmp_path, monkeypatch):
    assert expected(tmp_path, "train/x", 10.0) == 10.0
    record(tmp_path, "train/x", 10.0, 35.0)
    record(tmp_path, "train/y", 1.0, 35.0)  # too short to say anything
    assert expected(tmp_path, "train/x", 20.0) == 70.0
    assert expected(tmp_path, "train/y", 20.0) == 20.0
    monkeypatch.setattr(platform, "node", lambda: "another machine")
    assert expected(tmp_path, "train/x", 20.0) == 20.0


@pytest.mark.parametrize("damage", ["", "[]", '{"NODE": 3}', '{"NODE": {"train/x": "much"}}'])
def test_a_damaged_record_is_none(tmp_path, damage):
    (tmp_path / SPEEDS).write_text(damage.replace("NODE", platform.node()))
    assert expected(tmp_path, "train/x", 20.0) == 20.0


def test_clips_of_the_validation_count(tmp_path):
    def seconds(*options):
        cfg = composed("model=sound_cnn", f"outputs={tmp_path}", *options, command="train")
        return SoundNetwork(cfg).seconds()

    few, many = (seconds(f"sound_model.validation_clips={count}") for count in (100, 400))
    # 15 epochs of 300 more clips of validation and of training apartments each
    assert many - few == pytest.approx(15 * 2 * 300 / 1000)
    assert seconds("split=mini") > 0.2 * seconds("split=var")  # it is mostly validation


def test_apartments_that_are_there_cost_nothing(tmp_path):
    cfg = composed("model=sound_cnn", f"outputs={tmp_path}", command="train")
    trace = next(s for s in missing([SoundNetwork(cfg)]) if "reverberation" in s.title)
    before = trace.seconds()
    trace.paths[0].parent.mkdir(parents=True)
    trace.paths[0].touch()
    assert 0 < trace.seconds() < 0.8 * before


def test_runs_of_each_agent_have_their_own_record(tmp_path):
    def run(agent):
        return Evaluation(
            composed(f"agent={agent}", "acoustics=diffraction", f"outputs={tmp_path}")
        )

    posterior, plain = run("belief"), run("ours_noexp")
    before, of_belief = plain.expected(), posterior.expected()
    assert of_belief > 2 * before  # a posterior takes longer
    record(tmp_path, posterior.timed_as, 100.0, 300.0)
    assert posterior.expected() == pytest.approx(3 * of_belief)
    assert plain.expected() == before
