"""Runs of one setting as a side of a comparison."""

import shutil
from pathlib import Path

import pytest
from made_runs import records, write_run

from avn.core.errors import UserError
from avn.pipeline.run_sides import compare_sides, differences, find_run, open_side


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Two agents with two seeds each, and two networks of the first seed of `ours`."""
    folder = tmp_path_factory.mktemp("outputs")
    for seed in (0, 1):
        write_run(folder, records("greedy", seed), code=f"aaaaaaa{seed}")
        write_run(folder, records("ours", seed), code=f"bbbbbbb{seed}")
    write_run(folder, records("ours", 0, draw=1), train_seed=1, code="bbbbbbb2")
    return folder


@pytest.fixture
def outputs(written, tmp_path):
    """A copy of the runs, to which others are added and which are spoilt."""
    return Path(shutil.copytree(written, tmp_path / "outputs"))


def test_a_run_is_found_by_folder_hash_and_agent(outputs):
    folder = outputs / "eval" / "greedy" / "ring-alarm" / "seed0-aaaaaaa0"
    for name in (str(folder), "aaaaaaa0", "greedy-aaaaaaa0", "seed0-aaaaaaa0"):
        assert find_run(name, outputs).samefile(folder)
    for name in ("aaaa", "ours-aaaaaaa0", "greedy", ""):
        with pytest.raises(UserError, match=name or "RUN: empty"):
            find_run(name, outputs)
    write_run(outputs, records("other"), code="aaaaaaa0")
    with pytest.raises(UserError, match="aaaaaaa0: 2 runs"):
        find_run("aaaaaaa0", outputs)


def test_runs_with_commas_are_one_side(outputs):
    one = open_side("aaaaaaa0,aaaaaaa1", outputs)
    other = open_side("bbbbbbb1,bbbbbbb0", outputs)
    assert (one.name, one.seeds, one.networks) == ("greedy", (0, 1), (0,))
    assert compare_sides(one, other).episodes == 2 * len(records())
    nets = open_side("bbbbbbb0,bbbbbbb2", outputs)
    assert nets.networks == (0, 1)
    assert compare_sides(open_side("aaaaaaa0", outputs), nets).networks == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("aaaaaaa0,bbbbbbb0", "not a repetition of .*agent.name"),
        ("aaaaaaa0,aaaaaaa0", "has the seed and train_seed of"),
        ("bbbbbbb0,bbbbbbb1,bbbbbbb2", "seed=1 train_seed=1 is not given"),
    ],
)
def test_a_side_of_unlike_runs_is_refused(outputs, text, said):
    with pytest.raises(UserError, match=said):
        open_side(text, outputs)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"subset": "validation"}, "subset: test in aaaaaaa0 and validation in cccccccc"),
        ({"split": {"name": "mini"}}, "split.name: var in aaaaaaa0 and mini in cccccccc"),
        ({"episodes": "exhaustive"}, "episodes: frozen in"),
        (
            {"protocol": {"name": "var", "max_moves_ratio": 3.0}},
            "protocol.max_moves_ratio: 2.0 in aaaaaaa0 and 3.0 in cccccccc",
        ),
    ],
)
def test_settings_of_the_episodes_have_to_agree(outputs, change, said):
    write_run(outputs, records("other"), code="cccccccc", **change)
    with pytest.raises(UserError, match=said):
        compare_sides(open_side("aaaaaaa0", outputs), open_side("cccccccc", outputs))


def test_recordings_are_compared_by_content(outputs):
    moved = write_run(outputs, records("other"), code="cccccccc", sound={"ring": "x", "alarm": "y"})
    one, other = open_side("aaaaaaa0", outputs), open_side("cccccccc", outputs)
    assert compare_sides(one, other).scenes == 5
    kept = moved / "recordings.csv"
    kept.write_text(kept.read_text().replace("00000000", "11111111", 1))
    with pytest.raises(UserError, match=r"ring: 00000000 in aaaaaaa0 and 11111111 in cccccccc"):
        compare_sides(one, open_side("cccccccc", outputs))
    kept.unlink()  # of an earlier version: the path is all that is known
    with pytest.raises(UserError, match=r"sound.ring: ring in aaaaaaa0 and x in cccccccc"):
        compare_sides(one, open_side("cccccccc", outputs))


def test_settings_that_differ_are_named(outputs):
    for code, cost in (("cccccccc", 2.0), ("dddddddd", 4.0)):
        planner = {"name": "dijkstra", "collision_cost": cost}
        write_run(outputs, records("ours"), code=code, planner=planner)
    one, other = (open_side(code, outputs) for code in ("cccccccc", "dddddddd"))
    assert differences(one, other) == ["planner.collision_cost 2.0 / 4.0"]
    assert differences(open_side("aaaaaaa0", outputs), one) == []  # the agents are named anyway


@pytest.mark.parametrize(
    ("file", "spoil"),
    [
        ("episodes.csv", lambda text: text[: len(text) // 2]),
        ("episodes.csv", lambda text: text.replace("room_1", "room_7")),
        ("results.csv", lambda text: ""),
        ("results.csv", None),
        ("episodes.csv", None),
        ("config.yaml", None),
        ("config.yaml", lambda text: "{"),
        ("recordings.csv", lambda text: "a\n1\n"),
    ],
)
def test_unfinished_and_damaged_runs_are_refused(outputs, file, spoil):
    path = outputs / "eval" / "greedy" / "ring-alarm" / "seed0-aaaaaaa0" / file
    text = path.read_text()
    path.unlink()
    if spoil:
        path.write_text(spoil(text))
    with pytest.raises(UserError, match="seed0-aaaaaaa0"):
        open_side(str(path.parent), outputs)
