"""`film=` of `avn.eval` on the mini split."""

from pathlib import Path

import imageio_ffmpeg
import pandas as pd
import pytest
from small import SMALL, fitting


def run(command, outputs, *more):
    # a run of greedy reads no renderer, but its films do
    own = [key for key in SMALL if key.startswith("renderer.") and any("film=" in o for o in more)]
    # an action is a second of film
    settings = (*fitting("agent=greedy", *SMALL), "protocol.max_actions=20", *own, *more)
    return command("eval", "agent=greedy", *settings, f"outputs={outputs}")


def test_films_of_what_is_asked_for_lie_in_the_run_and_change_nothing(command, outputs):
    code, out, err = run(command, outputs)
    assert code == 0, err
    folder = Path(out[-1])
    before = {path: path.read_bytes() for path in folder.glob("*.csv")}
    episodes = pd.read_csv(folder / "episodes.csv")
    word = "success" if episodes["success"].any() else "failure"
    code, out, err = run(command, outputs, "film=1", f"film_show={word}")
    assert code == 0, err
    assert Path(out[-1]) == folder
    (film,) = (folder / "films").glob("*.mp4")
    room, sound, number, outcome = film.stem.split("-")
    row = episodes.query(f"scene == '{room}' and sound == '{sound}' and episode == {number}")
    assert row["outcome"].item() == outcome
    _, seconds = imageio_ffmpeg.count_frames_and_secs(str(film))
    assert seconds == pytest.approx(row["actions"].item() + 1, abs=0.2)
    assert {path: path.read_bytes() for path in folder.glob("*.csv")} == before
    # a second time they are there already
    stamp = film.stat().st_mtime_ns
    code, out, _ = run(command, outputs, "film=1", f"film_show={word}")
    assert code == 0
    assert film.stat().st_mtime_ns == stamp
    assert str(film) in out
    # of other views it is made anew
    code, out, _ = run(command, outputs, "film=1", f"film_show={word}", "renderer.camera.pitch=0")
    assert code == 0
    assert Path(out[-1]) == folder
    assert film.stat().st_mtime_ns != stamp


@pytest.mark.parametrize(
    ("option", "said"),
    [("film=-1", "film: -1 is out of range"), ("film_show=best", "film_show: 'best' is none of")],
)
def test_a_mistake_is_one_line(command, outputs, option, said):
    code, _, err = run(command, outputs, "film=1", option)
    assert code == 2
    assert len(err) == 1
    assert said in err[0]


def test_a_film_at_twice_the_speed_is_half_as_long_and_stands_beside(command, outputs):
    code, out, err = run(command, outputs, "film=1")
    assert code == 0, err
    folder = Path(out[-1])
    code, out, err = run(command, outputs, "film=1", "film_speed=2")
    assert code == 0, err
    assert Path(out[-1]) == folder
    (fast,) = folder.glob("films/*-speed2.mp4")
    slow = fast.with_name(fast.name.replace("-speed2", ""))
    seconds = [imageio_ffmpeg.count_frames_and_secs(str(path))[1] for path in (fast, slow)]
    assert 2 * seconds[0] == pytest.approx(seconds[1], abs=0.4)
    code, _, err = run(command, outputs, "film=1", "film_speed=0")
    assert code == 2
    assert "film_speed: 0 is out of range; give steps per second, 0.5 to 10" in err[0]
