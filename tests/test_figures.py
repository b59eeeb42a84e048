"""`python -m avn.figures` on runs of the mini split."""

from pathlib import Path

from PIL import Image
from small import EYES, SMALL
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from avn import figures


def made(command, outputs, agent):
    eyes = EYES if agent == "ours_noexp" else ()
    code, out, err = command("eval", f"agent={agent}", *SMALL, *eyes, f"outputs={outputs}")
    assert code == 0, err
    return out[-1]


def test_pictures_lie_in_the_run_and_in_tensorboard(command, outputs, capfd):
    ours, memory, greedy = (
        made(command, outputs, agent) for agent in ("ours_noexp", "ours_exp", "greedy")
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
    assert {"figures/breakdown", "figures/trajectories"} <= set(tags)
    assert any(tag.startswith("figures/belief/") for tag in tags)


def pictures(folder: str) -> list[Path]:
    return sorted((Path(folder) / "figures").glob("*.png"))


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
