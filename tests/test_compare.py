"""`avn compare` on folders of runs that are written here."""

import os
import subprocess
import sys

import pandas as pd
import pytest
from made_runs import records, write_run

from avn import compare


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("outputs")
    for seed in (0, 1):
        write_run(folder, records("greedy", seed, rate=0.2), code=f"aaaaaaa{seed}")
        write_run(folder, records("ours", seed, rate=0.8), code=f"bbbbbbb{seed}")
    write_run(folder, records("short", scenes=2), code="cccccccc")
    write_run(folder, records("few", scenes=2), code="dddddddd")
    return folder


def test_the_table_has_what_the_comparison_has(outputs, capsys, tmp_path):
    sides = ["bbbbbbb0,bbbbbbb1", "aaaaaaa0,aaaaaaa1"]
    path = tmp_path / "new" / "differences.csv"
    assert compare.main([*sides, "--outputs", str(outputs), "--csv", str(path)]) == 0
    out = capsys.readouterr().out
    table = pd.read_csv(path).set_index("metric")
    row = 100 * table.loc["sr", ["mean_a", "mean_b", "difference", "low", "high", "detectable"]]
    shown = next(line for line in out.splitlines() if line.startswith("success"))
    a, b, difference, low, high, detectable = row.tolist()
    numbers = f"{a:.1f} {b:.1f} {difference:+.1f} {low:+.1f} to {high:+.1f} {detectable:.1f}"
    assert shown.split()[1:] == numbers.split()
    test = table.loc["sr"]
    assert f"only A succeeds in {test['only_a']:.0f} episodes" in " ".join(out.split())
    assert "A  ours (seeds 0, 1; train_seed 0)" in out
    words = " ".join(out.split())
    assert "95 % interval: apartments, sources and episodes resampled" in words
    assert "takes episodes as independent" in words
    assert list(path.parent.iterdir()) == [path]


def test_each_pair_of_three_has_a_table(outputs, capsys):
    assert compare.main(["aaaaaaa0", "bbbbbbb0", "aaaaaaa0", "--outputs", str(outputs)]) == 0
    out = capsys.readouterr().out
    assert out.count("success  ") == 3
    assert "only B in 0; p = 1.0000" in " ".join(out.split())


def test_several_networks_have_a_column_and_a_single_one_is_named(outputs, capsys):
    for network in (1, 2):
        walked = records("ours", 0, draw=network, rate=0.8)
        write_run(outputs, walked, train_seed=network, code=f"eeeeeee{network}")
    sides = ["bbbbbbb0,eeeeeee1,eeeeeee2", "aaaaaaa0"]
    assert compare.main([*sides, "--outputs", str(outputs)]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "sd between networks" in words
    assert "One network of B: the result is of this network only." in words
    assert "networks, apartments, sources and episodes resampled" in words
    assert "McNemar's test needs one network of each side" in words


def test_few_apartments_have_a_reason_instead_of_an_interval(outputs, capsys):
    assert compare.main(["cccccccc", "dddddddd", "--outputs", str(outputs)]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "No interval and no smallest difference: too few apartments" in words
    assert "resampled" not in words


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "required: RUN"),
        (["aaaaaaa0"], "RUN: aaaaaaa0 alone; give two runs or more"),
        (["aaaaaaa0", "outputs=here"], "outputs=here: no run; give --outputs here"),
        (["aaaaaaa0", "nothing"], "nothing: neither a folder nor a run of"),
        (["aaaaaaa0", "bbbbbbb1"], "seeds differ: 0 of aaaaaaa0 and 1 of bbbbbbb1"),
        (["aaaaaaa0", "aaaaaaa0,"], "RUN: empty"),
        (["aaaaaaa0", "cccccccc"], "apartments differ"),
        (["aaaaaaa0", "bbbbbbb0", "--colour"], "unrecognized arguments: --colour"),
        (["aaaaaaa0", "bbbbbbb0", "--csv", "/proc/no/file.csv"], "/proc/no"),
    ],
)
def test_a_mistake_is_one_line(outputs, capsys, arguments, said):
    assert compare.main([*arguments, "--outputs", str(outputs)]) == 2
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert line.startswith("avn.compare: ")
    assert said in line
    assert out == ""


def test_a_folder_that_is_not_there_is_one_line(capsys, tmp_path):
    assert compare.main(["a", "b", "--outputs", str(tmp_path / "no")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "a: no folder, and there is no " in line


def test_it_imports_no_torch(outputs):
    code = (
        "import sys; from avn import compare; assert compare.main(sys.argv[1:]) == 0; "
        "assert 'torch' not in sys.modules"
    )
    arguments = ["aaaaaaa0", "bbbbbbb0", "--outputs", str(outputs)]
    subprocess.run(
        [sys.executable, "-c", code, *arguments], check=True, env=os.environ, capture_output=True
    )
