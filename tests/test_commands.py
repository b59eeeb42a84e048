"""The commands on the real pipeline, with the mini split and few rays."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import soundfile
from small import fitting

from avn.apartments.splits import FROZEN
from avn.reporting.results import read_csv

SMALL = (
    "split=mini",
    "processes=1",
    "acoustics.rays=300",
    "acoustics.seconds=0.2",
    "sound_model.epochs=1",
    "sound_model.validation_clips=100",
    "realisations=1",
    "renderer.camera.size=32",
    "renderer.samples=1",
    "renderer.light.gather_rays=4",
    "renderer.light.shadow_rays=2",
    "renderer.light.spacing=0.3",
)


def run_greedy(command, outputs, *more):
    return command(
        "eval", "agent=greedy", *fitting("agent=greedy", *SMALL), f"outputs={outputs}", *more
    )


def copy(command, outputs, tmp_path):
    """A copy, for spoiling, of what a run of greedy made."""
    run_greedy(command, outputs, "sound=alarm")
    return Path(shutil.copytree(outputs, tmp_path / "copy"))


def test_greedy_walks_on_sound_that_was_made_on_the_way(command, outputs):
    code, out, err = run_greedy(command, outputs, "sound=alarm")
    assert code == 0, err
    folder = Path(out[-1])
    episodes = pd.read_csv(folder / "episodes.csv")
    results = pd.read_csv(folder / "results.csv")
    assert len(episodes) == 2 * 20
    assert results["scene"].tolist()[-1] == "average"
    assert results["sr"].iloc[-1] == pytest.approx(episodes["success"].mean())
    assert results["spl"].iloc[-1] == pytest.approx(episodes["spl"].mean())
    assert list(folder.glob("events.out.tfevents.*"))


def test_a_finished_run_is_reused_and_gives_the_same_bytes_when_made_again(
    command, outputs, tmp_path
):
    again = copy(command, outputs, tmp_path)
    _, out, _ = run_greedy(command, outputs, "sound=alarm")
    assert not any("missing" in line for line in out)
    first = (Path(out[-1]) / "episodes.csv").read_bytes()
    shutil.rmtree(again / "eval")
    shutil.rmtree(again / "hear")
    _, out, _ = run_greedy(command, again, "sound=alarm")
    assert (Path(out[-1]) / "episodes.csv").read_bytes() == first


def test_a_sweep_ends_with_mean_and_spread_and_takes_overrides_on_both_sides_of_m(command, outputs):
    code, out, err = command(
        "eval", "agent=random_walk", "split=mini", "-m", f"outputs={outputs}", "sound=alarm"
    )
    assert code == 0, err
    assert any("3 seeds: SR" in line and "+-" in line for line in out)
    summary = pd.read_csv(Path(out[-1]) / "results.csv")
    seeds = [
        pd.read_csv(file)
        for file in sorted(outputs.glob("eval/random_walk/alarm/seed*/results.csv"))
    ]
    assert len(seeds) == 3
    rates = [table.loc[table["scene"] == "average", "sr"].item() for table in seeds]
    row = summary[summary["scene"] == "average"]
    assert row["sr"].item() == pytest.approx(np.mean(rates))
    assert row["sr_std"].item() == pytest.approx(np.std(rates, ddof=1))


def test_a_failing_job_is_named_and_the_others_run(command, outputs):
    code, out, err = command(
        "eval",
        "agent=random_walk",
        "split=mini",
        f"outputs={outputs}",
        "-m",
        "protocol.num_starts=20,100000",
        "seed=0",
    )
    assert code == 2
    assert any("failed: " in line and "protocol.num_starts=100000" in line for line in err)
    assert "1 of 2 jobs failed" in err[-1]
    assert any("1 seed: SR" in line for line in out)


def test_a_sound_that_is_missing_fails_its_own_job_alone(command, outputs):
    code, out, err = command(
        "eval",
        "agent=random_walk",
        "split=mini",
        f"outputs={outputs}",
        "sound=nosuch.wav,alarm",
        "seed=0",
        "-m",
    )
    assert code == 2
    assert any("failed: " in line and "nosuch.wav" in line for line in err)
    assert "1 of 2 jobs failed" in err[-1]
    assert any(line.startswith("random_walk, alarm") for line in out)


def test_a_sweep_keeps_unlike_runs_apart(command, outputs):
    code, out, err = command(
        "eval",
        "agent=random_walk",
        "split=mini",
        f"outputs={outputs}",
        "sound=alarm",
        "protocol.num_starts=5,10",
        "seed=0,1,2",
        "-m",
    )
    assert code == 0, err
    lines = [line for line in out if line.startswith("random_walk, alarm (")]
    assert len(lines) == 2
    assert all("3 seeds" in line for line in lines)


def test_any_audio_file_is_a_sound(command, outputs, tmp_path):
    tone = 0.1 * np.sin(2 * np.pi * 500 * np.arange(4410) / 44100)
    soundfile.write(tmp_path / "my tone.wav", np.column_stack([tone, tone]), 44100)
    code, out, err = run_greedy(command, outputs, f"sound={tmp_path / 'my tone.wav'}")
    assert code == 0, err
    assert set(pd.read_csv(Path(out[-1]) / "results.csv")["sound"]) == {"my tone"}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "does not exist"),
        (b"", "empty"),
        (b"this is no audio at all, but text" * 9, "not audio"),
    ],
)
def test_a_bad_sound_file_is_one_line(command, outputs, tmp_path, content, said):
    path = tmp_path / "bad.wav"
    if content is not None:
        path.write_bytes(content)
    code, _, err = run_greedy(command, outputs, f"sound={path}")
    assert code == 2
    assert len(err) == 1
    assert str(path) in err[0]
    assert said in err[0]


def test_a_split_without_a_test_apartment_is_one_line(command, outputs):
    code, _, err = command(
        "eval", "agent=oracle", "split=mini", "split.test=0", f"outputs={outputs}"
    )
    assert code == 2
    assert len(err) == 1
    assert "split.test" in err[0]


def test_what_is_missing_is_refused_with_auto_false(command, tmp_path):
    code, _, err = run_greedy(command, tmp_path / "o", "auto=false")
    assert code == 2
    assert "auto=false" in err[-1]


def test_training_prints_its_figures_and_its_folder(command, outputs):
    code, out, err = command(
        "train", "model=sound_cnn", *fitting("model=sound_cnn", *SMALL), f"outputs={outputs}"
    )
    assert code == 0, err
    metrics = json.loads((Path(out[-1]) / "metrics.json").read_text())
    assert any("error_m/validation/in_sight/all" in line for line in out)
    assert metrics["error_m/validation/in_sight/all"] > 0


def test_generate_draws_plans_and_writes_clips(command, outputs):
    code, out, err = command(
        "generate",
        *fitting("generate", *SMALL),
        f"outputs={outputs}",
        "export=wav",
        "clips=[[0,4],[1,9]]",
    )
    assert code == 0, err
    (line,) = [text for text in out if "/room_1-" in text and " cells, " in text]
    room = Path(line.split(": ")[0])
    assert (room / "floor_plan.png").read_bytes()[:4] == b"\x89PNG"
    waves = sorted((room / "wav").glob("*.wav"))
    assert len(waves) == 2 * 3
    samples, rate = soundfile.read(waves[0])
    assert rate == 16000
    assert samples.shape == (16000, 2)
    code, _, err = command(
        "generate",
        *fitting("generate", *SMALL),
        f"outputs={outputs}",
        "export=wav",
        "clips=[[9,4]]",
    )
    assert code == 2
    assert "clips" in err[-1]


def test_reproduce_runs_the_rows_that_are_named(command, outputs):
    code, out, err = command(
        "reproduce",
        *fitting("agent=oracle", *SMALL),
        f"outputs={outputs}",
        "rows=random_walk,oracle",
        "seeds=0",
    )
    assert code == 0, err
    results = pd.read_csv(Path(out[-1]) / "results.csv")
    assert set(results["agent"]) == {"random_walk", "oracle"}
    best = results[(results["agent"] == "oracle") & (results["scene"] == "average")]
    assert best["sr"].to_numpy() == pytest.approx(1)
    assert best["spl"].to_numpy() == pytest.approx(1)
    files = {path.name for path in Path(out[-1]).iterdir()}
    assert {"across_seeds.csv", "cells.csv", "table.md", "table.tex"} <= files
    assert any(line.startswith("oracle: 100.0 / 100.0 after") for line in out)


def test_reproduce_takes_the_sounds_that_are_named(command, outputs):
    options = (f"outputs={outputs}", "split=mini", "rows=random_walk", "seeds=0")
    code, out, err = command("reproduce", *options, "sounds=ring,clock")
    assert code == 0, err
    results = pd.read_csv(Path(out[-1]) / "results.csv")
    assert set(results["sound"]) == {"ring", "clock", "all"}
    code, _, err = command("reproduce", *options, "sounds=bark")
    assert code == 2
    assert "sounds: 'bark' is none of ring, alarm, clock" in err[-1]


def test_sounds_may_be_a_list_with_paths(command, outputs, tmp_path):
    # names that a reader of tables could take for a number or for nothing
    for name in ("440", "nan"):
        soundfile.write(tmp_path / f"{name}.wav", np.sin(np.arange(16000)), 16000)
    sounds = f"sound=[ring,{tmp_path / '440.wav'},{tmp_path / 'nan.wav'}]"
    code, out, err = command(
        "eval", "agent=random_walk", "split=mini", f"outputs={outputs}", sounds
    )
    assert code == 0, err
    sounds = set(read_csv(Path(out[-1]) / "results.csv")["sound"])
    assert sounds == {"ring", "440", "nan", "all"}


def test_a_refused_run_leaves_nothing_behind(command, tmp_path):
    for mistake in ("agent.name=../../esc", "seed=-1", "realisations=0", "sound=nosuch.wav"):
        code, _, err = run_greedy(command, tmp_path / "o", mistake)
        assert code == 2, err
        assert len(err) == 1
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_a_key_of_a_value_is_named(command, tmp_path):
    options = ("agent=greedy", "split=mini", f"outputs={tmp_path}", "split.folder.x=1")
    code, _, err = command("eval", *options)
    assert code == 2
    assert len(err) == 1
    assert "split.folder.x=1" in err[0]


def test_an_option_that_has_moved_is_named_with_its_new_name(command, tmp_path):
    options = ("agent=plan_noexp", f"outputs={tmp_path}", "mapper.network.epochs=1")
    code, _, err = command("eval", *options)
    assert code == 2
    assert err == ["avn.eval: mapper.network.epochs: is now occupancy_model.epochs; give that"]


def test_an_unknown_material_is_refused_before_anything_is_traced(command, tmp_path):
    plans = Path(shutil.copytree(FROZEN / "var", tmp_path / "plans"))
    room = plans / "room_1.json"
    room.write_text(room.read_text().replace('"parquet"', '"cheese"', 1))
    code, _, err = command("generate", f"split.folder={plans}", f"outputs={tmp_path}/o")
    assert code == 2
    assert len(err) == 1
    assert "room_1" in err[0]
    assert "cheese" in err[0]


def test_a_seed_that_is_named_twice_counts_once(command, tmp_path):
    options = ("agent=random_walk", "split=mini", f"outputs={tmp_path}", "sound=alarm")
    code, out, err = command("eval", *options, "seed=0,0,1", "-m")
    assert code == 0, err
    row = pd.read_csv(Path(out[-1]) / "results.csv").query("scene == 'average'")
    rates = [
        pd.read_csv(next(tmp_path.glob(f"eval/random_walk/alarm/seed{seed}-*/results.csv")))
        .query("scene == 'average'")["sr"]
        .item()
        for seed in (0, 1)
    ]
    assert row["seeds"].item() == 2
    assert row["sr"].item() == pytest.approx(np.mean(rates))
    assert any("its figures mean nothing" in line for line in out)


def test_no_table_of_mini_has_figures_of_the_paper(command, outputs):
    options = (*fitting("agent=greedy", *SMALL), f"outputs={outputs}")
    code, out, err = command("eval", "agent=greedy", *options)
    assert code == 0, err
    assert not any("Gan et al" in line for line in out)
    headings = [
        line
        for line in out
        if line.startswith(("success rate", "difficulty", "source estimates: "))
    ]
    assert len(headings) == 3
    assert sum("its figures mean nothing" in line for line in out) == 3
    code, out, err = command("reproduce", *options, "rows=random_walk,greedy", "seeds=0")
    assert code == 0, err
    assert not any("Gan et al" in line for line in out)
    text = (Path(out[-1]) / "table.md").read_text()
    assert "its figures mean nothing" in text
    assert "test apartments of mini" in text
    assert "too few sources" in text
    assert pd.read_csv(Path(out[-1]) / "cells.csv")["paper_sr"].isna().all()
