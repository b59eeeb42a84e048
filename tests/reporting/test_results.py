from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_runs import records

from avn.core.errors import UserError
from avn.reporting.results import (
    EPISODE_COLUMNS,
    INTERVALS,
    RESULT_COLUMNS,
    across_runs,
    headline,
    shown_scenes,
    summarise,
    write_csv,
)


def episodes(
    agent: str = "greedy", seed: int = 0, sounds: tuple[str, ...] = ("ring", "alarm")
) -> pd.DataFrame:
    """Records of two rooms with five sources; the second room has twice as many episodes."""
    rng = np.random.default_rng([seed, *agent.encode()])
    rows = [
        {
            "agent": agent,
            "protocol": "var",
            "acoustics": "resonance",
            "look": "once",
            "sound": sound,
            "scene": room,
            "seed": seed,
            "episode": source * count + index,
            "start_cell": index,
            "start_heading": 0,
            "source": source,
        }
        for sound in sounds
        for room, count in (("room_1", 4), ("room_2", 8))
        for source in range(5)
        for index in range(count)
    ]
    frame = pd.DataFrame(rows)
    frame["success"] = rng.integers(0, 2, len(frame))
    for column in ("spl", "softspl", "sna", "sna_goal"):
        frame[column] = frame["success"] * rng.random(len(frame))
    frame["dtg"] = 5 * rng.random(len(frame))
    return frame


def only(results: pd.DataFrame, **labels: str) -> pd.Series:
    for name, value in labels.items():
        results = results[results[name] == value]
    assert len(results) == 1
    return results.iloc[0]


def test_columns_are_the_published_ones() -> None:
    assert ",".join(RESULT_COLUMNS) == (
        "agent,protocol,acoustics,look,sound,scene,seed,episodes,sr,spl,softspl,sna,dtg,sna_goal,"
        "sr_low,sr_high,spl_low,spl_high,softspl_low,softspl_high,sna_low,sna_high,"
        "dtg_low,dtg_high,sna_goal_low,sna_goal_high"
    )
    assert tuple(summarise(episodes()).columns) == RESULT_COLUMNS
    assert EPISODE_COLUMNS[:8] == (*RESULT_COLUMNS[:7], "episode")


def test_figures_are_means_by_sound_and_room() -> None:
    frame = episodes()
    results = summarise(frame)
    assert len(results) == 3 * 3
    own = frame[(frame["sound"] == "alarm") & (frame["scene"] == "room_2")]
    row = only(results, sound="alarm", scene="room_2")
    assert row["episodes"] == 40
    for figure, column in (("sr", "success"), ("spl", "spl"), ("sna", "sna"), ("dtg", "dtg")):
        assert row[figure] == pytest.approx(own[column].mean())
        assert row[f"{figure}_low"] < row[figure] < row[f"{figure}_high"]  # of five sources


def test_too_few_apartments_and_sources_have_no_interval() -> None:
    frame = episodes()
    known = summarise(frame)["sr_low"].notna()
    assert set(summarise(frame).loc[known, "scene"]) == {"room_1", "room_2"}  # of five sources
    few = summarise(frame[frame["source"] < 4])
    assert few[list(INTERVALS)].isna().all(axis=None)
    assert few["sr"].notna().all()
    five = summarise(records())
    assert five[list(INTERVALS)].notna().all(axis=None)


def test_the_average_varies_with_the_apartments_and_not_with_the_sources_alone() -> None:
    # sources of one apartment are alike, so 25 of them say no more than the 5 apartments
    frame = records(sounds=("ring",), starts=20)
    rates = dict(zip(sorted(set(frame["scene"])), (0.1, 0.3, 0.5, 0.7, 0.9), strict=True))
    frame["success"] = (frame["start_cell"] < frame["scene"].map(rates) * 20).astype(int)
    table = summarise(frame).set_index("scene")
    assert table.loc["room_1", ["sr_low", "sr_high"]].to_numpy(float) == pytest.approx(
        [0.1, 0.1], abs=0.07
    )
    low, high = table.loc["average", ["sr_low", "sr_high"]]
    assert low < 0.3
    assert high > 0.7


def test_the_order_of_the_records_does_not_count() -> None:
    frame = records()
    shuffled = frame.sample(frac=1, random_state=0)
    keys = ["sound", "scene"]
    tables = [summarise(own).sort_values(keys, ignore_index=True) for own in (frame, shuffled)]
    pd.testing.assert_frame_equal(*tables, check_exact=True)


def test_one_scene_has_no_average_of_its_own() -> None:
    frame = episodes()
    assert shown_scenes(summarise(frame)) == ["room_1", "room_2", "average"]
    assert shown_scenes(summarise(frame[frame["scene"] == "room_2"])) == ["room_2"]


def test_average_counts_every_room_the_same() -> None:
    frame = episodes()
    results = summarise(frame)
    for sound in ("ring", "alarm", "all"):
        rooms = [only(results, sound=sound, scene=room)["spl"] for room in ("room_1", "room_2")]
        assert only(results, sound=sound, scene="average")["spl"] == pytest.approx(np.mean(rooms))
    assert only(results, sound="all", scene="room_1")["episodes"] == 40
    assert only(results, sound="all", scene="average")["episodes"] == 120
    assert frame["spl"].mean() != pytest.approx(only(results, sound="all", scene="average")["spl"])


def test_one_sound_has_no_row_for_all() -> None:
    results = summarise(episodes(sounds=("alarm",)))
    assert set(results["sound"]) == {"alarm"}
    assert headline(results)["sr"] == only(results, sound="alarm", scene="average")["sr"]


def test_headline_is_over_all_sounds_and_rooms() -> None:
    results = summarise(episodes())
    assert headline(results)["spl"] == only(results, sound="all", scene="average")["spl"]
    with pytest.raises(ValueError, match="one average"):
        headline(summarise(pd.concat([episodes(), episodes("oracle")])))


def test_no_episode_is_refused() -> None:
    with pytest.raises(UserError, match="split: no episode"):
        summarise(episodes().iloc[:0])


def test_across_runs_gives_mean_interval_and_spread_over_seeds() -> None:
    walked = pd.concat([records(seed=seed) for seed in range(3)])
    results = pd.concat([summarise(records(seed=seed), draws=0) for seed in range(3)])
    table = across_runs(walked)
    assert len(table) == 3 * 6
    row = only(table, sound="all", scene="average")
    figures = results[(results["sound"] == "all") & (results["scene"] == "average")]["sr"]
    assert (row["seeds"], row["networks"], row["episodes"]) == (3, 1, len(walked))
    assert row["sr"] == pytest.approx(figures.mean())
    assert row["sr_std"] == pytest.approx(np.std(figures, ddof=1))
    assert row["sr_low"] < row["sr"] < row["sr_high"]
    assert np.isnan(row["sr_network_std"])


def test_across_runs_names_the_spread_between_networks_and_resamples_them() -> None:
    walked = pd.concat(
        [
            records(seed=seed, draw=network, rate=0.3 + 0.2 * network).assign(train_seed=network)
            for seed in (0, 1)
            for network in range(3)
        ]
    )
    row = only(across_runs(walked), sound="all", scene="average")
    means = walked.groupby("train_seed")["success"].mean()
    assert row["networks"] == 3
    assert row["sr"] == pytest.approx(means.mean())
    assert row["sr_network_std"] == pytest.approx(means.std())
    seeds = walked.groupby("seed")["success"].mean()
    assert row["sr_std"] == pytest.approx(seeds.std())
    one = only(across_runs(walked.drop(columns="train_seed")), sound="all", scene="average")
    assert row["sr_high"] - row["sr_low"] > 1.5 * (one["sr_high"] - one["sr_low"])
    missing = walked[(walked["train_seed"] < 2) | (walked["seed"] < 1)]
    with pytest.raises(UserError, match="train_seed: the networks walked different episodes"):
        across_runs(missing)


def test_write_csv_writes_what_can_be_read(tmp_path: Path) -> None:
    results = summarise(episodes())
    path = tmp_path / "run" / "results.csv"
    write_csv(results, path)
    pd.testing.assert_frame_equal(pd.read_csv(path), results, check_dtype=False)
    first = path.read_bytes()
    write_csv(summarise(episodes()), path)
    assert path.read_bytes() == first


def test_write_csv_leaves_nothing_half_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "results.csv"
    write_csv(pd.DataFrame({"a": [1]}), path)

    def broken(frame: pd.DataFrame, target: Path, **_: object) -> None:
        Path(target).write_text("half", encoding="utf-8")
        raise OSError("disk full")

    monkeypatch.setattr(pd.DataFrame, "to_csv", broken)
    with pytest.raises(OSError, match="disk full"):
        write_csv(pd.DataFrame({"a": [2]}), path)
    assert path.read_text(encoding="utf-8") == "a\n1\n"
    assert list(tmp_path.iterdir()) == [path]


def test_metrics_of_what_changes_in_an_episode_stand_behind_the_others() -> None:
    frame = episodes()
    plain = summarise(frame)
    frame["success_when_silent"] = frame["success"] * (frame["start_cell"] % 2)
    found = summarise(frame)
    assert tuple(found.columns) == (*RESULT_COLUMNS, "sws", "sws_low", "sws_high")
    pd.testing.assert_frame_equal(found[list(RESULT_COLUMNS)], plain)
    room = only(found, sound="ring", scene="room_1")
    own = frame[(frame["sound"] == "ring") & (frame["scene"] == "room_1")]
    assert room["sws"] == pytest.approx(own["success_when_silent"].mean())
    across = across_runs(frame)
    assert {"sws", "sws_std", "sws_network_std"} <= set(across)
