"""`python -m avn.figures` on runs of the mini split."""

from pathlib import Path
from typing import Any

from PIL import Image
from small import EYES, SMALL, fitting
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.backend.event_processing.event_multiplexer import EventMultiplexer
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

from avn import figures

# Networks of this file alone: the trainings of other files write no curves.
OWN = ("sound_model.patience=7", "occupancy_model.patience=7")


def made(command, outputs, agent):
    eyes = EYES if agent == "plan_noexp" else ()
    settings = fitting(f"agent={agent}", *SMALL, *eyes, *OWN)
    code, out, err = command("eval", f"agent={agent}", *settings, f"outputs={outputs}")
    assert code == 0, err
    return out[-1]


def test_pictures_lie_in_the_run_and_in_tensorboard(command, outputs, capfd):
    ours, memory, greedy = (
        made(command, outputs, agent) for agent in ("plan_noexp", "plan_exp", "greedy")
    )
    assert figures.main([ours, greedy, "--count", "1"]) == 0
    names = {path.name.split("-")[0].removesuffix(".png") for path in pictures(ours)}
    assert names == {"breakdown", "trajectories", "estimates", "belief"}
    assert figures.main([memory, "--episode", "1", "--episode", "5"]) == 0
    assert len([path for path in pictures(memory) if path.name.startswith("memory-")]) == 2
    for path in pictures(ours) + pictures(memory):
        with Image.open(path) as picture:
            assert picture.width > 500
    # again, and TensorBoard has them once
    assert figures.main([ours, greedy, "--count", "1"]) == 0
    events = list(Path(ours).glob("*.figures"))
    assert len(events) == 1
    tags = EventAccumulator(str(events[0])).Reload().Tags()["images"]
    folder = f"typical-1-with-greedy-{Path(greedy).name}"
    assert {f"figures/{folder}/breakdown", f"figures/{folder}/trajectories"} <= set(tags)
    assert any(tag.startswith(f"figures/{folder}/belief/") for tag in tags)
    # another selection stands beside it
    before = pictures(ours)
    assert figures.main([ours, "--count", "1"]) == 0
    assert set(before) < set(pictures(ours))
    assert len(list(Path(ours).glob("*.figures"))) == 2


def pictures(folder: str) -> list[Path]:
    return sorted((Path(folder) / "figures").glob("*/*.png"))


def test_tensorboard_finds_curves_hparams_figures_and_audio_under_one_folder(command, outputs):
    ours, greedy = (made(command, outputs, agent) for agent in ("plan_noexp", "greedy"))
    assert figures.main([greedy, "--count", "1"]) == 0
    found = EventMultiplexer().AddRunsFromDirectory(str(outputs)).Reload()
    for folder, agent in ((ours, "plan_noexp"), (greedy, "greedy")):
        run = str(Path(folder).relative_to(outputs))
        settings, metrics = hparams(found, run)
        assert settings["agent"].string_value == agent
        assert settings["seed"].number_value == 0
        assert list(settings)[:4] == ["agent", "sound", "protocol", "acoustics"]
        # TensorBoard sorts the columns by name and shows five
        assert sorted(settings)[:5] == ["acoustics", "agent", "protocol", "seed", "sound"]
        assert metrics[:2] == ["success", "spl"]
        assert {"success", "spl", "by_distance/spl"} <= set(found.Runs()[run]["scalars"])
        # a curve over the distance of the start in metres, and no dots of single scenes
        steps = [event.step for event in found.Scalars(run, "by_distance/success")]
        assert steps == sorted(steps)
        assert len(steps) > 2
        assert not [tag for tag in found.Runs()[run]["scalars"] if tag.count("/") == 2]
        assert (settings["with_localisation"].string_value != "") == (agent == "plan_exp")
    first = (list(settings), metrics)
    drawn = found.Runs()[str(Path(greedy).relative_to(outputs))]["images"]
    assert any(tag.startswith("figures/") for tag in drawn)
    trained = {name: tags for name, tags in found.Runs().items() if name.startswith("train/")}
    heard = {name: tags for name, tags in trained.items() if name.startswith("train/sound_cnn-")}
    assert heard
    for name, tags in heard.items():
        settings, metrics = hparams(found, name)
        assert settings["with_kind"].string_value == "training"
        # other rows of the session train on many sounds
        sounds = settings["sounds_in_training"].string_value
        assert sounds in ("ring+alarm+clock", "65-sounds")
        assert name.split("/")[2] == f"sound_cnn-resonance-mini-{sounds}-seed0"
        # the columns of all rows of the HPARAMS tab are the same
        assert (list(settings), metrics) == first
        assert "best_validation" in tags["scalars"]
        assert {"loss/steps", "error_m/validation/all/all"} <= set(tags["scalars"])
        assert "audio/alarm/in_sight" in tags["audio"]
        assert "locations/alarm" in tags["images"]
    seen = [tags for name, tags in trained.items() if name.startswith("train/occupancy_cnn-")]
    assert seen
    assert all("windows" in tags["images"] and "loss/steps" in tags["scalars"] for tags in seen)


def hparams(found: EventMultiplexer, run: str) -> tuple[dict[str, Any], list[str]]:
    """The settings of a run, and the names of the figures that it is compared by."""

    def read(tag: str) -> HParamsPluginData:
        data = found.SummaryMetadata(run, f"_hparams_/{tag}").plugin_data
        assert data.plugin_name == "hparams"
        return HParamsPluginData.FromString(data.content)

    compared = read("experiment").experiment.metric_infos
    settings = read("session_start_info").session_start_info.hparams
    order = [info.name for info in read("experiment").experiment.hparam_infos]
    return {name: settings[name] for name in order}, [info.name.tag for info in compared]


def test_mistakes_are_one_line(command, outputs, capfd, tmp_path):
    greedy = made(command, outputs, "greedy")
    for arguments, said in (
        ([str(tmp_path)], "no run's folder"),
        ([greedy, "--episode", "99999"], "has no row 99999"),
        ([greedy, "--show", "best"], "'best' is none of"),
    ):
        assert figures.main(arguments) == 2
        (line,) = capfd.readouterr().err.strip().splitlines()
        assert said in line
