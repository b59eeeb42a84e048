"""Files that were cut, changed or are of another making: one line, and nothing is overwritten."""

import shutil
from pathlib import Path

import h5py
import pandas as pd
import pytest
import torch
from small import QUIET, SMALL, composed, fitting

from avn.pipeline.apartments import Apartments
from avn.pipeline.scenes import DirectSound

WORLD = [*QUIET, *(own for own in SMALL if not own.startswith("sound="))]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """A folder of this file alone, so that what lies in it is one run and what it needs."""
    return tmp_path_factory.mktemp("outputs")


def run_greedy(command, outputs, *more):
    return command("eval", *_greedy(outputs), *more)


def _greedy(outputs):
    return ("agent=greedy", *fitting("agent=greedy", *WORLD), f"outputs={outputs}")


def run_folder(command, outputs):
    """The folder of a run of greedy, which is made once."""
    if not list(outputs.glob("eval/greedy/alarm/seed*/results.csv")):
        code, _, err = run_greedy(command, outputs, "sound=alarm")
        assert code == 0, err
    (folder,) = outputs.glob("eval/greedy/alarm/seed*")
    return folder


def copied(command, outputs, tmp_path):
    """A copy, for spoiling, of what a run of greedy made."""
    run_folder(command, outputs)
    return Path(shutil.copytree(outputs, tmp_path / "copy"))


def _cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def _flip(path):
    with path.open("r+b") as file:
        file.seek(path.stat().st_size // 2)
        byte = file.read(1)[0]
        file.seek(-1, 1)
        file.write(bytes([byte ^ 1]))


def _other_version(path):
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = 77


@pytest.mark.parametrize(
    ("spoil", "said"),
    [(_cut, "cut short"), (_flip, "changed"), (_other_version, "format version 77")],
)
@pytest.mark.parametrize("name", ["geometry", "acoustics-tail", "acoustics-resonance"])
def test_a_spoilt_scene_file_is_one_line_and_is_left_as_it_is(
    command, outputs, tmp_path, name, spoil, said
):
    mine = copied(command, outputs, tmp_path)
    shutil.rmtree(mine / "eval")
    shutil.rmtree(mine / "hear")
    room = composed("agent=greedy", *WORLD)
    sound = DirectSound(room, Apartments(room, "test"))
    (path,) = (mine / sound.paths[0].relative_to("outputs")).parent.glob(f"{name}-*.h5")
    spoil(path)
    content = path.read_bytes()
    code, _, err = run_greedy(command, mine, "sound=alarm")
    assert code == 2
    lines = [line for line in err if line.startswith("avn.eval")]
    assert len(lines) == 1
    assert str(path) in lines[0]
    assert said in lines[0]
    assert path.read_bytes() == content
    assert not list(mine.rglob("results.csv"))


def test_a_checkpoint_of_another_config_is_one_line(command, outputs, tmp_path):
    mine = copied(command, outputs, tmp_path)
    (folder,) = (p for p in (mine / "train").iterdir() if p.is_dir())
    checkpoint = torch.load(folder / "best.ckpt", weights_only=True)
    checkpoint["hyper_parameters"]["batch"] = 7
    torch.save(checkpoint, folder / "best.ckpt")
    shutil.rmtree(mine / "hear")
    shutil.rmtree(mine / "eval")
    code, _, err = run_greedy(command, mine, "sound=alarm")
    assert code == 2
    assert str(folder / "best.ckpt") in err[-1]
    assert "sound_model.batch" in err[-1]


@pytest.mark.parametrize("name", ["episodes.csv", "results.csv"])
@pytest.mark.parametrize("spoil", [_cut, lambda path: path.write_text("")], ids=["cut", "empty"])
def test_a_damaged_run_is_one_line(command, outputs, tmp_path, name, spoil):
    mine = copied(command, outputs, tmp_path)
    folder = mine / run_folder(command, outputs).relative_to(outputs)
    spoil(folder / name)
    code, _, err = run_greedy(command, mine, "sound=alarm")
    assert code == 2
    assert str(folder) in err[-1]
    assert "damaged; delete the folder" in err[-1]


def test_a_run_of_an_earlier_version_is_one_line(command, outputs, tmp_path):
    mine = copied(command, outputs, tmp_path)
    folder = mine / run_folder(command, outputs).relative_to(outputs)
    for name in ("episodes.csv", "results.csv"):
        table = pd.read_csv(folder / name)
        lacking = [column for column in table if "sna_goal" in column]
        assert lacking
        table.drop(columns=lacking).to_csv(folder / name, index=False)
    for call in (("eval", *_greedy(mine), "sound=alarm"), ("figures", str(folder))):
        code, _, err = command(*call)
        assert code == 2
        assert err[-1].endswith(
            f"{folder}: an earlier version of avn made the run, episodes.csv has no sna_goal; "
            "delete the folder and run again"
        )


def test_a_bit_of_a_checkpoint_that_flipped_is_one_line(command, outputs, tmp_path):
    mine = copied(command, outputs, tmp_path)
    shutil.rmtree(mine / "hear")
    shutil.rmtree(mine / "eval")
    (path,) = mine.glob("train/*/best.ckpt")
    _flip(path)
    code, _, err = run_greedy(command, mine, "sound=alarm")
    assert code == 2
    assert str(path) in err[-1]
    assert "to train again" in err[-1]
