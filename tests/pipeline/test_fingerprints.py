"""Which settings make which product anew: those that change it must, all others must not."""

from functools import cache

import pytest
from small import composed

from avn.core.errors import UserError
from avn.navigation.protocols import GOAL_MEANINGS
from avn.pipeline.apartments import Apartments
from avn.pipeline.occupancy import LocalPatches, OccupancyNetwork
from avn.pipeline.policy import Policy
from avn.pipeline.run import Evaluation
from avn.pipeline.scenes import DirectSound, Geometry, LateReverberation
from avn.pipeline.sound_network import SoundNetwork, SourceEstimates
from avn.pipeline.stop_classifier import StopNetwork, StopProbabilities
from avn.pipeline.views import RenderedViews
from avn.pipeline.visual_features import VisualEmbeddings

MINI = ("agent=plan_exp", "split=mini", "protocol=var_stop", "occupancy_model=small")
NONE = set()
RUN = {"run"}
# what listens, what it hears, and where
HEARD = {"run", "estimates", "stops"}
EARS = HEARD | {"sound", "stop", "policy"}
DIRECT = EARS | {"direct"}
SOUNDING = DIRECT | {"tail"}
LOOKING = {"patches", "run_windows", "policy_map"}
SEEN = {"views", "occupancy", "embeddings", "run", "policy"} | LOOKING
EVERY = SOUNDING | SEEN | {"geometry"}


@cache
def products(*overrides):
    cfg = composed(*MINI, *overrides)
    apartments = Apartments(cfg, "test")
    actor = composed("agent=a3c_va", "split=mini", *_fitting(overrides))
    mapping = composed("agent=a3c_va_mapper", "split=mini", *_fitting(overrides))
    windows = composed("agent=plan_noexp", "split=mini", *_fitting(overrides))
    return {
        "geometry": Geometry(cfg, apartments),
        "tail": LateReverberation(cfg, apartments),
        "direct": DirectSound(cfg, apartments),
        "views": RenderedViews(cfg, apartments),
        "embeddings": VisualEmbeddings(cfg, apartments),
        "sound": SoundNetwork(cfg),
        "stop": StopNetwork(cfg),
        "occupancy": OccupancyNetwork(cfg),
        "estimates": SourceEstimates(cfg, apartments),
        "stops": StopProbabilities(cfg, apartments),
        "patches": LocalPatches(cfg, apartments),
        "policy": Policy(actor),
        "policy_map": Policy(mapping),
        "run": Evaluation(cfg),
        "run_windows": Evaluation(windows),
    }


def _fitting(overrides):
    """Overrides of keys that the other rows have too."""
    own = ("agent.", "planner.", "mapper.top", "stop_model", "protocol", "occupancy_model")
    return [text for text in overrides if not text.startswith(own)]


def moved(override):
    one, other = products(), products(override)
    return {name for name in one if one[name].fingerprint != other[name].fingerprint}


@pytest.mark.parametrize(
    ("override", "wanted"),
    [
        ("outputs=elsewhere", NONE),
        ("processes=1", NONE),
        ("auto=false", NONE),
        ("trainer=cpu", NONE),
        ("trainer.profiler=simple", NONE),
        ("logger=[csv,tensorboard]", NONE),
        ("logger=none", NONE),
        ("protocol.radius=3", NONE),  # of another goal
        ("planner.error.sigma=3", NONE),  # of another filter
        ("stop_model.criterion=balanced", RUN),
        ("stop_model.threshold=0.7", RUN),
        ("protocol.num_starts=5", RUN),
        ("protocol.cap=goal", RUN),
        ("mapper.top=2", RUN),
        ("planner.max_rotations=5", RUN),
        ("localisation=retrieval", RUN),
    ],
)
def test_how_an_agent_acts_is_no_part_of_what_it_learnt(override, wanted):
    assert moved(override) == wanted


@pytest.mark.parametrize(
    ("override", "wanted"),
    [
        ("seed=5", RUN | {"run_windows", "estimates", "stops"}),
        ("episodes=exhaustive", RUN | {"run_windows"}),
        ("sound=alarm", HEARD | {"run_windows"}),
        ("realisations=2", HEARD | {"run_windows", "policy", "policy_map"}),
        ("sound_model.epochs=3", {*EARS, "run_windows", "policy_map"} - {"stops", "stop"}),
        ("stop_model.positives=0.5", {"stop", "stops", "run"}),
        ("protocol=stop", {"stop", "stops", "run"}),
        ("occupancy_model.epochs=3", {"occupancy", "patches"}),
        ("occupancy_model.appearances=3", {"occupancy", "patches"}),
        ("renderer.camera.pitch=-20", SEEN),
        ("backbone.size=64", {"embeddings", "run", "policy", "policy_map"}),
        ("trainer.max_epochs=3", {*EARS, "occupancy", *LOOKING}),
        ("trainer.precision=bf16-mixed", {*EARS, "occupancy", *LOOKING}),
        ("callbacks=learning_rate", {*EARS, "occupancy", *LOOKING}),
        ("algorithm.gamma=0.9", {"policy", "policy_map"}),
        ("algorithm.exploration_walks=3", NONE),  # neither explores
        ("mapper.visible_above=0.2", {"run_windows", "policy_map"}),
        # the regimes share the reverberation
        ("acoustics=diffraction", {*DIRECT, "run_windows", "policy_map"}),
        ("acoustics.rays=500", {*SOUNDING, "run_windows", "policy_map"}),
        ("acoustics.head=ku100", NONE),
        ("acoustics.head=kemar", {*SOUNDING, "run_windows", "policy_map"}),
        ("acoustics.receiver_height=1.4", {*SOUNDING, "geometry", "run_windows", "policy_map"}),
        ("split.folder=var", EVERY),
    ],
)
def test_a_setting_makes_anew_what_it_changes(override, wanted):
    assert moved(override) == wanted


@pytest.mark.parametrize(
    ("row", "override"),
    [
        (("agent=oracle", "episodes=exhaustive"), "protocol.num_starts=7"),
        (("agent=oracle", "episodes=exhaustive"), "protocol.exploration_steps=33"),
        (("agent=greedy",), "baseline.slack=0.9"),
        (("agent=plan_exp", "localisation=retrieval"), "mapper.sharpness=0.5"),
        (("agent=plan_exp", "localisation=retrieval"), "mapper.confidence=0.9"),
        (
            ("agent=plan_noexp", "agent.oracle_inputs=[source_estimate,local_patch]"),
            "realisations=2",
        ),
        (
            ("agent=plan_noexp", "agent.oracle_inputs=[source_estimate,local_patch]"),
            "renderer.camera.size=64",
        ),
        (("agent=a3c_va",), "baseline.top=1"),
    ],
)
def test_what_makes_no_difference_to_a_run_makes_none_anew(row, override):
    one, other = (Evaluation(composed("split=mini", *row, *more)) for more in ((), (override,)))
    assert one.fingerprint == other.fingerprint
    assert override.split("=")[0] not in one.read()


@pytest.mark.parametrize(
    ("row", "override"),
    [
        (("agent=oracle",), "protocol.num_starts=7"),
        (("agent=greedy", "protocol=stop"), "baseline.slack=0.9"),
        (("agent=plan_exp",), "mapper.sharpness=0.5"),
        (("agent=plan_exp", "planner.source_filter=bayes"), "planner.error.sigma=0.9"),
        (("agent=plan_noexp", "agent.oracle_inputs=[source_estimate,local_patch]"),
         "renderer.camera.pitch=-20"),
        (("agent=plan_noexp",), "mapper.visible_above=0.3"),
        (("agent=plan_exp", "mapper.local_patches=true", "occupancy_model=small"),
         "mapper.visible_above=0.3"),
        (("agent=a3c_va",), "baseline.samples=false"),
    ],
)  # fmt: skip
def test_what_makes_a_difference_to_a_run_is_read(row, override):
    one, other = (Evaluation(composed("split=mini", *row, *more)) for more in ((), (override,)))
    assert one.fingerprint != other.fingerprint
    assert override.split("=")[0] in one.read()


@pytest.mark.parametrize(
    "override",
    ["protocol.num_starts=5", "protocol.name=mine", "subset=validation", "baseline.samples=false"],
)
def test_evaluations_choose_no_policy(override):
    one, other = (
        Policy(composed("agent=a3c_va_m", "split=mini", *more)) for more in ((), (override,))
    )
    assert one.fingerprint == other.fingerprint
    assert override.split("=")[0] not in one.read()


def test_two_rows_never_share_a_folder():
    one, other = (
        Policy(composed("agent=a3c_v", "split=mini", f"agent.name={name}")) for name in "ab"
    )
    assert one.folder != other.folder
    assert one.fingerprint != other.fingerprint


def test_the_checkpoint_that_a_training_goes_on_from_counts_by_its_content(tmp_path):
    paths = [tmp_path / name for name in ("a.ckpt", "b.ckpt", "c.ckpt")]
    for path, text in zip(paths, ("one", "one", "two"), strict=True):
        path.write_text(text)
    for kind, key in ((SoundNetwork, "sound_model"), (Policy, "algorithm")):
        options = ("agent=a3c_va", "split=mini")
        found = [kind(composed(*options, f"{key}.ckpt_path={path}")) for path in paths]
        usual, one, same, other = (
            stage.fingerprint for stage in (kind(composed(*options)), *found)
        )
        assert one == same
        assert len({usual, one, other}) == 3


def test_a_network_of_the_default_trainer_is_the_one_of_old():
    """Its fingerprint, and with it the networks that users have, must not change."""
    changed = composed("agent=greedy", "split=mini", "trainer.precision=32-true", "logger=none")
    assert (
        SoundNetwork(changed).inputs()
        == SoundNetwork(composed("agent=greedy", "split=mini")).inputs()
    )
    assert not any("trainer" in str(value) for value in SoundNetwork(changed).inputs())


def test_a_radius_is_another_goal():
    row = ("agent=plan_noexp", "protocol=stop", "split=mini")
    one, other = (StopNetwork(composed(*row, f"protocol.radius={r}")) for r in (1, 2))
    assert one.fingerprint != other.fingerprint


def test_only_products_of_a_radius_depend_on_what_a_radius_means(monkeypatch):
    def fingerprints(protocol):
        rows = ("agent=plan_noexp", "agent=a3c_va")
        planner, actor = (composed(row, protocol, "split=mini") for row in rows)
        stages = (StopNetwork(planner), Policy(actor))
        return [stage.fingerprint for stage in stages]

    now = {protocol: fingerprints(f"protocol={protocol}") for protocol in ("stop", "var_stop")}
    monkeypatch.delitem(GOAL_MEANINGS, "radius")
    assert all(
        one != other for one, other in zip(fingerprints("protocol=stop"), now["stop"], strict=True)
    )
    assert fingerprints("protocol=var_stop") == now["var_stop"]


def test_the_default_cap_is_in_no_fingerprint_of_an_actor_critic():
    row = ("agent=a3c_va", "split=mini")
    default, other = (Policy(composed(*row, f"protocol.cap={cap}")) for cap in ("source", "goal"))
    assert default.fingerprint != other.fingerprint
    (rules,) = [node for node in default.inputs() if isinstance(node, dict) and "goal" in node]
    assert "cap" not in rules
    assert "protocol.cap" in default.read() & other.read()
    assert "protocol.cap" not in Policy(composed(*row, "protocol=stop")).read()


def test_sounds_are_told_apart_by_their_order():
    one, other = (
        Evaluation(composed("split=mini", f"sound={sounds}"))
        for sounds in ("[ring,alarm]", "[alarm,ring]")
    )
    assert one.fingerprint != other.fingerprint


def test_a_threshold_of_the_config_needs_no_network():
    row = ("agent=plan_noexp", "protocol=var_stop", "split=mini")
    given = Evaluation(composed(*row, "stop_model.threshold=0.7"))
    assert StopNetwork(given.cfg).threshold() == 0.7
    # the probabilities are those of the network all the same, but only if they are missing
    assert not any(isinstance(need, StopNetwork) for need in given.needs())
    assert any(isinstance(need, StopNetwork) for need in Evaluation(composed(*row)).needs())
    with pytest.raises(UserError, match=r"stop_model\.criterion: 'best'"):
        StopNetwork(composed(*row, "stop_model.criterion=best")).threshold()
