"""`avn ls` on folders of runs that are written here."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from omegaconf import OmegaConf
from small import composed

from avn import ls


@pytest.fixture
def runs(tmp_path):
    """Three runs, of which the last has a damaged config."""
    for agent, seed, sounds, rate in (
        ("greedy", 0, ("ring", "clock"), 0.25),
        ("plan_exp", 1, ("ring",), 0.5),
        ("broken", 2, ("ring",), 0.125),
    ):
        folder = tmp_path / "eval" / agent / "-".join(sounds) / f"seed{seed}-00000000"
        folder.mkdir(parents=True)
        named = {"agent": agent, "protocol": "stop", "acoustics": "diffraction", "split": "mini"}
        cfg = {group: {"name": name} for group, name in named.items()}
        cfg |= {"sound": {name: name for name in sounds}, "seed": seed, "train_seed": 0}
        cfg |= {"subset": "test", "episodes": "frozen"}
        (folder / "config.yaml").write_text(
            "{" if agent == "broken" else yaml.safe_dump(cfg, sort_keys=False)
        )
        pooled = "all" if len(sounds) > 1 else sounds[0]
        rows = [f"{pooled},room_1,0.9,0.9,0", f"{pooled},average,{rate},{rate / 2},0"]
        rows += ["ring,average,0.1,0.1,0"] if len(sounds) > 1 else []
        (folder / "results.csv").write_text(
            "\n".join(["sound,scene,sr,spl,sna_goal", *rows]) + "\n"
        )
    (tmp_path / "eval" / "greedy" / "ring" / "seed0-unfinished").mkdir(parents=True)
    return tmp_path


def listed(capsys, *arguments):
    assert ls.main(arguments) == 0
    return json.loads(capsys.readouterr().out)


def test_each_finished_run_has_its_world_and_figures(runs, capsys):
    rows = listed(capsys, f"outputs={runs}", "format=json", "sort=seed")
    assert [row["agent"] for row in rows] == ["greedy", "plan_exp", None]
    first = rows[0]
    assert (first["success"], first["spl"]) == (0.25, 0.125)
    assert (first["sound"], first["protocol"], first["split"]) == ("ring+clock", "stop", "mini")
    assert first["acoustics"] == "diffraction"
    assert Path(first["folder"]).is_dir()
    assert rows[2]["success"] == 0.125


@pytest.mark.parametrize(
    ("condition", "said"),
    [
        ("unheard", ""),
        ("gain_minus_6", "gain=0.501"),
        ("noise_white_10", "noise=white snr=10"),
        ("noise_household_0", "noise=6-recordings snr=0"),
        ("other_head", "head=kemar"),
        ("distractor_told", "distractor=other_category told"),
        ("silence", "schedule=intermittent"),
        ("odometry_noise", "odometry=noisy"),
        ("moving", "motion=walking"),
    ],
)
def test_a_run_says_in_which_condition_it_was(runs, capsys, condition, said):
    cfg = composed("agent=belief", "acoustics=diffraction", f"condition={condition}")
    (file,) = runs.glob("eval/greedy/*/seed0-00000000/config.yaml")
    file.write_text(OmegaConf.to_yaml(cfg, resolve=True))
    (row,) = listed(capsys, f"outputs={runs}", "format=json", "agent=belief")
    assert row["condition"] == said


def test_a_damaged_microphone_is_no_traceback(runs, capsys):
    (file,) = runs.glob("eval/greedy/*/seed0-00000000/config.yaml")
    for damaged in ("noises: [white], snr: 3, gain: loud", "noises: {white: 1}, snr: [3]"):
        file.write_text(f"agent: {{name: greedy}}\nmicrophone: {{{damaged}}}\n")
        (row,) = listed(capsys, f"outputs={runs}", "format=json", "agent=greedy")
        assert row["condition"] is None
    assert listed(capsys, f"outputs={runs}", "format=json", "sort=seed")[-1]["condition"] is None


def test_another_level_is_said(runs, capsys):
    (file,) = runs.glob("eval/greedy/*/seed0-00000000/config.yaml")
    file.write_text("agent: {name: greedy}\nmicrophone: {level: [-6.0, 6.0]}\n")
    (row,) = listed(capsys, f"outputs={runs}", "format=json", "agent=greedy")
    assert row["condition"] == "level=-6 to 6"


def test_runs_are_filtered_and_sorted_by_column(runs, capsys):
    shared = (f"outputs={runs}", "format=json")
    assert [r["agent"] for r in listed(capsys, *shared, "agent=greedy")] == ["greedy"]
    assert len(listed(capsys, *shared, "agent=greedy,plan_exp", "seed=0,1")) == 2
    assert listed(capsys, *shared, "agent=greedy", "seed=1") == []
    by = [row["success"] for row in listed(capsys, *shared, "sort=-spl")]
    assert by == [0.5, 0.25, 0.125]


def test_a_run_of_an_earlier_version_has_no_figures(runs, capsys):
    (results,) = (runs / "eval" / "greedy").rglob("results.csv")
    lines = results.read_text().splitlines()
    results.write_text("\n".join(line.rpartition(",")[0] for line in lines) + "\n")
    (row,) = listed(capsys, f"outputs={runs}", "format=json", "agent=greedy")
    assert (row["success"], row["spl"], row["protocol"]) == (None, None, "stop")


def test_the_table_and_csv_hold_the_same(runs, capsys):
    assert ls.main([f"outputs={runs}"]) == 0
    out = capsys.readouterr().out
    assert "25.0 %" in out
    assert "3 runs" in out
    assert "its figures mean nothing" in out
    assert ls.main([f"outputs={runs}", "format=csv"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("agent,sound,protocol,acoustics,split")
    assert len(lines) == 4


@pytest.mark.parametrize(
    ("argument", "said"),
    [
        ("colour=red", "colour: no column of the list; there are agent,"),
        ("agent", "agent: not of the form key=value"),
        ("sort=size", "size: no column"),
        ("format=xml", "format: 'xml' is none of table, csv, json"),
        ("outputs=/no/such", "outputs: there is no folder /no/such"),
    ],
)
def test_a_mistake_is_one_line(runs, capsys, argument, said):
    assert ls.main([f"outputs={runs}", argument]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_it_imports_no_large_library(runs):
    code = (
        "import sys; from avn import ls; assert ls.main([sys.argv[1]]) == 0; "
        "assert not {'torch', 'pandas', 'hydra', 'numpy'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code, f"outputs={runs}"], check=True)
