"""`avn rm` on runs of the mini split."""

from pathlib import Path

import pytest
from filelock import FileLock

from avn import rm


@pytest.fixture
def runs(command, tmp_path):
    """Two runs over the same apartment, and products of no run."""
    folders = []
    for seed in (0, 1):
        options = ("agent=random_walk", "split=mini", "sound=ring", f"seed={seed}")
        code, out, err = command("eval", *options, f"outputs={tmp_path}")
        assert code == 0, err
        folders.append(Path(out[-1]))
    for name in ("hear/source_estimates/a.h5", "generate/room_9-0/views-0.h5", "train/net-0/a"):
        path = tmp_path / name
        path.parent.mkdir(parents=True)
        path.write_bytes(b"0" * 3000)
    return tmp_path, folders


def files(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_products_of_no_run_are_listed_and_deleted_only_on_request(runs, capfd):
    outputs, _ = runs
    before = files(outputs)
    assert rm.main([f"outputs={outputs}"]) == 0
    out = capfd.readouterr().out
    assert "9.0 kB in 3 products that none of 2 runs needs" in out
    assert "delete=true deletes" in out
    assert files(outputs) == before
    # what another process is making is kept
    with FileLock(outputs / "train" / ".net-0.lock"):
        assert rm.main([f"outputs={outputs}", "delete=true"]) == 0
    assert "kept, another process is making it" in capfd.readouterr().out
    gone = {name for name in before - files(outputs) if not name.endswith(".lock")}
    assert gone == {"hear/source_estimates/a.h5", "generate/room_9-0/views-0.h5"}


def test_a_run_is_deleted_where_it_is_named_and_what_it_shares_is_kept(runs, capfd):
    outputs, folders = runs
    assert rm.main([str(folders[0]), f"outputs={outputs}", "delete=true"]) == 0
    assert not folders[0].exists()
    assert (folders[1] / "results.csv").is_file()
    geometry = list(outputs.glob("generate/*/geometry-*.h5"))
    assert len(geometry) == 1
    # without any run, nothing is needed
    assert rm.main([str(folders[1]), f"outputs={outputs}", "delete=true"]) == 0
    assert not list(outputs.glob("generate/*/*.h5"))


def test_mistakes_are_one_line(runs, capfd):
    outputs, folders = runs
    (folders[0] / "config.yaml").write_text("{")
    for argument, said in (
        (str(outputs / "eval"), "no folder of a finished run"),
        ("delete=yes", "delete: 'yes' is neither true nor false"),
        ("remove=true", "remove=true: no such option"),
        ("delete=true", "config.yaml: not a config of this avn"),
    ):
        before = files(outputs)
        assert rm.main([f"outputs={outputs}", argument]) == 2
        (line,) = capfd.readouterr().err.splitlines()
        assert said in line
        assert files(outputs) == before
