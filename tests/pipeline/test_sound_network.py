"""Which settings enter which hash: what changes a result must, machine settings must not."""

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra

from avn.config import folder, schema
from avn.core.errors import UserError
from avn.dataset import build
from avn.pipeline import scenes, sound_network, stop_classifier
from avn.pipeline.agent import build_agent
from avn.pipeline.run import run_hash

NONE, RUN, HEARD, TRAINED = (), ("run",), ("run", "heard"), ("run", "heard", "trained")
EVERY = ("run", "heard", "trained", "scenes")


@pytest.fixture(scope="module")
def composed():
    schema.register()
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(folder.conf_folder()), version_base="1.3"):
        yield lambda *overrides: compose(
            "eval", overrides=["agent=greedy", "split=mini", *overrides]
        )


def hashes(cfg):
    return {
        "run": run_hash(cfg),
        "heard": sound_network.hear_hash(cfg),
        "trained": sound_network.model_hash(cfg),
        "scenes": scenes.scenes_folder(cfg).name,
    }


def moved(before, after):
    return {key for key in before if before[key] != after[key]}


@pytest.mark.parametrize(
    ("override", "wanted"),
    [
        ("outputs=elsewhere", NONE),
        ("processes=1", NONE),
        ("auto=false", NONE),
        ("seed=5", RUN),
        ("episodes=exhaustive", RUN),
        ("protocol=stop", RUN),
        ("protocol.starts=5", RUN),
        ("baseline.patience=2", RUN),
        ("sound=alarm", HEARD),
        ("takes=2", HEARD),
        ("sound_model.epochs=3", TRAINED),
        ("train_seed=3", TRAINED),
        ("sound_model.train_seed=3", TRAINED),
        ("sound_model.spectrogram.bands=32", TRAINED),
        ("microphone.noise_rms=0.1", TRAINED),
        # the regimes share the scene folder, for they share the reverberation
        ("acoustics=diffraction", TRAINED),
        ("acoustics.rays=500", EVERY),
        ("acoustics.seconds=0.3", EVERY),
        ("acoustics.ear_height=1.4", EVERY),
        ("split.seed=9", EVERY),
    ],
)
def test_a_setting_enters_the_hashes_of_what_it_changes(composed, override, wanted):
    assert moved(hashes(composed()), hashes(composed(override))) == set(wanted)


@pytest.mark.parametrize(
    ("versions", "name", "wanted"),
    [
        (sound_network.VERSIONS, "hear", HEARD),
        (sound_network.VERSIONS, "sound_cnn", TRAINED),
        (build.MAKING, "geometry", EVERY),
        (build.MAKING, "tail", EVERY),
        (build.MAKING, "first_arrival", EVERY),
    ],
)
def test_a_raised_version_makes_anew_what_depends_on_it(
    composed, monkeypatch, versions, name, wanted
):
    before = hashes(composed())
    monkeypatch.setitem(versions, name, versions[name] + 1)
    assert moved(before, hashes(composed())) == set(wanted)


@pytest.mark.parametrize(
    ("override", "changes"),
    [
        ("outputs=elsewhere", False),
        # how it decides is no part of what is learned
        ("stop_model.criterion=balanced", False),
        ("stop_model.threshold=0.7", False),
        ("protocol.starts=5", False),
        # the boxes of two protocols are the same
        ("protocol=var_stop", False),
        ("protocol.radius=2.0", False),
        ("protocol=stop", True),
        ("stop_model.positives=0.5", True),
        ("train_seed=1", True),
        ("acoustics=diffraction", True),
        ("microphone.noise_rms=0.1", True),
    ],
)
def test_what_the_stop_classifier_depends_on(composed, override, changes):
    before, after = composed("stop_model=cnn5"), composed("stop_model=cnn5", override)
    assert (
        stop_classifier.stop_model_hash(before) != stop_classifier.stop_model_hash(after)
    ) == changes
    assert (stop_classifier.stop_hash(before) != stop_classifier.stop_hash(after)) == changes


def test_a_radius_is_another_goal(composed):
    one, other = (
        composed("stop_model=cnn5", "protocol=stop", r) for r in ("seed=0", "protocol.radius=2.0")
    )
    assert stop_classifier.stop_model_hash(one) != stop_classifier.stop_model_hash(other)


def test_a_threshold_of_the_config_needs_no_network(composed):
    assert (
        stop_classifier.stop_threshold(composed("stop_model=cnn5", "stop_model.threshold=0.7"))
        == 0.7
    )
    with pytest.raises(UserError, match=r"stop_model\.criterion: 'best'"):
        stop_classifier.stop_threshold(composed("stop_model=cnn5", "stop_model.criterion=best"))


def test_none_cannot_say_stop(composed):
    with pytest.raises(UserError, match="stop_model: 'none' cannot say Stop; choose cnn5"):
        stop_classifier.stop_model(composed())


def test_sounds_are_told_apart_by_their_order(composed):
    one = composed("sound=[ring,alarm]")
    other = composed("sound=[alarm,ring]")
    assert sound_network.hear_hash(one) != sound_network.hear_hash(other)


@pytest.mark.parametrize(
    "row", sorted(path.stem for path in (folder.conf_folder() / "agent").glob("*.yaml"))
)
def test_only_rows_that_say_so_are_shown_the_truth(composed, row):
    cfg = composed(f"agent={row}")
    agent = build_agent(cfg)
    assert agent.privileged == cfg.agent.privileged == (row == "oracle")
    assert "sound" not in agent.needs or sound_network.hears(cfg)
