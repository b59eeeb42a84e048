"""The paper's two rows and ours on the real pipeline, with the mini split and small pictures."""

from pathlib import Path

import h5py
import pandas as pd
import pytest
from omegaconf import OmegaConf
from small import EYES, QUIET, SMALL, fitting

# One take of each clip of one sound.
WORLD = (
    *(own for own in SMALL if not own.startswith(("sound=", "realisations="))),
    *QUIET,
    "stop_model.epochs=1",
    "stop_model.validation_clips=100",
    "realisations=1",
    "sound=alarm",
    "protocol.max_actions=80",  # agents that have learnt nothing use them up
)


def ours(command, outputs, *more):
    agent, *others = more
    settings = fitting((agent, *others), *WORLD, *EYES)
    return command("eval", agent, *settings, f"outputs={outputs}", *others)


def records(out):
    return pd.read_csv(Path(out[-1]) / "episodes.csv")


@pytest.mark.parametrize("protocol", ["var", "stop"])
def test_it_sees_hears_maps_and_walks(command, outputs, protocol):
    code, out, err = ours(command, outputs, "agent=plan_noexp", f"protocol={protocol}")
    assert code == 0, err
    episodes = records(out)
    assert set(episodes["look"]) == {"once"}
    assert set(episodes["agent"]) == {"plan_noexp"}
    if protocol == "stop":
        # Whatever its network is worth after one epoch: who did not say Stop ran out of actions.
        assert set(episodes["outcome"]) <= {"success", "stopped_elsewhere", "out_of_actions"}


def test_it_follows_how_the_sound_arrives(command, outputs):
    world = ("protocol=stop", "look=around")
    code, out, err = ours(command, outputs, "agent=belief", *world)
    assert code == 0, err
    folder, episodes = Path(out[-1]), records(out)
    assert set(episodes["agent"]) == {"belief"}
    assert ours(command, outputs, "agent=belief", *world)[1][-1] == out[-1]
    assert not (folder / "source_estimates.csv").exists()


def test_exact_arrivals_are_an_oracle_input(command, outputs):
    exact = ("agent.oracle_inputs=[arrival]", "agent.privileged=true")
    code, out, err = ours(command, outputs, "agent=belief", *exact)
    assert code == 0, err
    assert set(records(out)["agent"]) == {"belief-true-arrival"}
    code, _, err = ours(command, outputs, "agent=plan_noexp", *exact)
    assert code == 2
    assert "arrival" in err[-1]


@pytest.mark.parametrize("row", ["direction_follower", "frontier", "srp_phat"])
def test_simple_rows_follow_how_the_sound_arrives(command, outputs, row):
    code, out, err = ours(command, outputs, f"agent={row}", "protocol=stop")
    assert code == 0, err
    assert set(records(out)["agent"]) == {row}


def test_a_sound_model_without_weights_estimates_places_too(command, outputs):
    code, out, err = ours(command, outputs, "agent=greedy", "sound_model=srp_phat")
    assert code == 0, err
    errors = pd.read_csv(Path(out[-1]) / "source_estimates.csv")
    assert (errors["error_m"] > 0).all()


def test_a_stop_classifier_that_is_not_asked_is_not_trained(command, outputs):
    given = ("agent=direction_follower", "stop_model=cnn5", "protocol=stop")
    settings = fitting(given, *WORLD, *EYES)
    code, _, err = command("eval", *settings, f"outputs={outputs}", *given)
    assert code == 2
    assert err[-1].startswith("avn.eval: stop_model")


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("train", ("model=sound_cnn",), "'srp_phat' has no weights, so there is nothing to train"),
        ("eval", ("agent=a3c_va",), "no embedding; choose a network, such as cnn5"),
        ("eval", ("agent=srp_phat", "sound_model.temperature=0"), "sound_model.temperature: 0"),
        ("eval", ("agent=srp_phat", "acoustics.rate=8000"), "up to 4000, half the sampling rate"),
        ("eval", ("agent=srp_phat", "sound_model.ckpt_path=x"), "sound_model.ckpt_path: not read"),
    ],
)
def test_what_a_model_without_weights_cannot_do_is_one_line(command, tmp_path, name, options, said):
    code, _, err = command(name, f"outputs={tmp_path}", *options, "sound_model=srp_phat")
    assert code == 2
    assert said in err[-1]
    assert "Traceback" not in "".join(err)


@pytest.mark.parametrize("row", ["ours_noexp", "ours_exp"])
def test_the_rows_of_the_paper_walk_and_say_stop(command, outputs, row):
    code, out, err = ours(command, outputs, f"agent={row}", "protocol=var_stop")
    assert code == 0, err
    episodes = records(out)
    assert set(episodes["agent"]) == {row}
    cfg = OmegaConf.load(Path(out[-1]) / "config.yaml")
    assert (cfg.planner.collision_cost, cfg.planner.source_filter) == (0.0, "latest")
    assert cfg.sound_model.flip_tta is cfg.occupancy_model.get("flip_tta", False) is False
    assert cfg.planner.obstacle_threshold == (0.5 if row == "ours_noexp" else 0.6)
    if row == "ours_exp":
        assert (cfg.mapper.localisation, cfg.mapper.grows, cfg.mapper.top) == (
            "retrieval",
            False,
            3,
        )


def test_a_run_made_again_has_the_same_bytes(command, outputs):
    _, out, _ = ours(command, outputs, "agent=plan_noexp")
    first = (Path(out[-1]) / "episodes.csv").read_bytes()
    for name in ("episodes.csv", "results.csv"):
        (Path(out[-1]) / name).unlink()
    _, out, _ = ours(command, outputs, "agent=plan_noexp")
    assert (Path(out[-1]) / "episodes.csv").read_bytes() == first


@pytest.mark.parametrize("localisation", ["retrieval", "retrieval+odometry"])
@pytest.mark.parametrize("exploration", ["shared", "own"])
def test_it_explores_and_finds_itself(command, outputs, localisation, exploration):
    options = (f"localisation={localisation}", f"exploration={exploration}")
    code, out, err = ours(command, outputs, "agent=plan_exp", *options)
    assert code == 0, err
    assert len(records(out)) == 2 * 4
    places = pd.read_csv(Path(out[-1]) / "localisation.csv").groupby("cells")["error_m"].mean()
    assert places["walked"] < places["other"]
    assert any("localisation by memory retrieval" in line for line in out)


def test_what_its_networks_tell_it_is_judged_beside_its_records(command, outputs):
    _, out, _ = ours(command, outputs, "agent=plan_noexp")
    seen = pd.read_csv(Path(out[-1]) / "local_patches.csv")
    room = seen[seen["cells"] == "visible"].set_index(["scene", "by"])["auc"]
    assert room["all", "network"] > 0.5
    assert room["room_1", "prior"] == pytest.approx(room["all", "prior"])  # the only room
    heard = pd.read_csv(Path(out[-1]) / "source_estimates.csv")
    assert set(heard["acoustics"]) == {"resonance"}
    assert not (Path(out[-1]) / "localisation.csv").exists()
    assert any("local patches: prediction of free cells" in line for line in out)


def test_the_truth_in_place_of_a_part_makes_a_bound_of_it(command, outputs):
    refused, _, err = ours(
        command, outputs, "agent=plan_noexp", "agent.oracle_inputs=[source_estimate,local_patch]"
    )
    assert refused == 2
    assert "agent.privileged: False, but 'PlannerAgent' is shown the truth" in err[-1]
    code, out, err = ours(
        command,
        outputs,
        "agent=plan_noexp",
        "agent.oracle_inputs=[source_estimate,local_patch]",
        "agent.privileged=true",
    )
    assert code == 0, err
    episodes = records(out)
    assert set(episodes["agent"]) == {"plan_noexp-true-source_estimate-true-local_patch"}
    assert episodes["success"].mean() > 0.8
    # what was given is no network's, so that there is nothing to judge
    assert not list(Path(out[-1]).glob("[hw]*.csv"))


def test_validation_apartments_can_be_walked_to_choose_on(command, outputs):
    _, out, _ = ours(command, outputs, "agent=plan_noexp", "subset=validation")
    assert set(records(out)["scene"]) == {"val_1"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("agent=belief", "sound_model=cnn5"), "choose a sound model with heads"),
        (("agent=belief", "planner.source_filter=bayes"), "planner.source_filter"),
        (("agent=belief", "planner.stop_above=0.4"), "planner.stop_above"),
        (("agent=belief", "planner.model.kept=2"), "planner.model.kept: 2"),
        (("agent=belief", "planner.model.forget_by=time"), "planner.model.forget_by: time; give"),
        (("agent=direction_follower", "planner.ahead=0.5"), "planner.ahead: 0.5"),
        (("agent=direction_follower", "planner.stop_within=1"), "planner.stop_within"),
        (("agent=frontier", "planner.sector=0"), "planner.sector: 0"),
        (("agent=plan_noexp", "mapper=none"), "mapper: 'none' remembers nothing to plan on"),
        (("agent=plan_noexp", "look=twice"), "look: 'twice' is none of once, around"),
        (("agent=plan_noexp", "subset=all"), "subset: 'all' is none of train, validation, test"),
        (("agent=plan_noexp", "baseline=greedy"), "cannot both act"),
        (
            ("agent=greedy", "agent.oracle_inputs=[map]"),
            "agent.oracle_inputs: only agents that plan",
        ),
        (("agent=plan_exp", "localisation=gps"), "localisation: 'gps' is none of retrieval"),
        (("agent=plan_exp", "episodes=exhaustive"), "have no exploration walk"),
        (("agent=plan_exp", "exploration=some"), "exploration: 'some' is none of shared, own"),
        (("agent=plan_exp", "mapper.local_patches=true"), "needs the observation 'local_patch'"),
        (
            ("agent=plan_noexp", "planner.source_filter=last"),
            "planner.source_filter: 'last' is none of latest",
        ),
    ],
)
def test_a_mistake_is_one_line(command, outputs, options, said):
    settings = fitting(options[0], *WORLD, *EYES)
    code, _, err = command("eval", *settings, f"outputs={outputs}", *options)
    assert code == 2
    assert said in err[-1]
    assert "Traceback" not in "".join(err)


def test_views_that_are_missing_are_refused_with_auto_false(command, tmp_path):
    settings = fitting("agent=plan_exp", *WORLD)
    code, _, err = command("eval", *settings, "agent=plan_exp", f"outputs={tmp_path}", "auto=false")
    assert code == 2
    assert "is missing and auto=false" in err[-1]


def test_damaged_features_are_one_line(command, outputs):
    ours(command, outputs, "agent=plan_exp")
    path = next(outputs.glob("generate/room_1-*/features-*.h5"))
    whole = path.read_bytes()
    try:
        with h5py.File(path, "r+") as file:
            file["features"][0, 0] += 1
        code, _, err = ours(command, outputs, "agent=plan_exp", "seed=5")
        assert code == 2
        assert f"{path}: changed since it was written" in err[-1]
    finally:
        path.write_bytes(whole)
