"""Summary of a sweep of runs that are written here."""

from pathlib import Path

import pandas as pd
import pytest
from made_runs import records, write_run

from avn.config.sweep_summary import summarise


@pytest.fixture
def job(tmp_path):
    """Function that writes a run and returns the record of its job."""

    def written(agent, seed=0, train_seed=0, **options):
        code = f"{len(list(tmp_path.rglob('results.csv'))):08d}"
        folder = write_run(tmp_path, records(agent, seed, draw=train_seed, **options), code=code)
        told = {"folder": str(folder), "outputs": str(tmp_path), "note": "", "error": None}
        return told | {"setting": f"agent={agent}, split=var", "train_seed": train_seed}

    return written


def summary(capsys, jobs):
    summarise(jobs, tell_folder=True)
    out = capsys.readouterr().out.splitlines()
    return out, pd.read_csv(Path(out[-1]) / "results.csv")


def test_networks_of_a_setting_are_pooled_and_their_spread_is_named(capsys, job):
    jobs = [
        job("ours", seed, network, rate=0.3 + 0.2 * network)
        for seed in (0, 1)
        for network in range(3)
    ]
    out, table = summary(capsys, jobs)
    (line,) = [line for line in out if line.startswith("ours, all")]
    assert "2 seeds, mean over 3 networks: SR" in line
    row = table[(table["sound"] == "all") & (table["scene"] == "average")].iloc[0]
    assert f"sd between networks {100 * row['sr_network_std']:.1f}" in line
    assert f"[{100 * row['sr_low']:.1f} to {100 * row['sr_high']:.1f}]" in line
    assert any("95 %, networks, apartments, sources and episodes resampled" in own for own in out)


def test_settings_are_compared_with_the_first(capsys, job):
    jobs = [job(agent, seed, rate=r) for agent, r in (("a", 0.2), ("b", 0.8)) for seed in (0, 1)]
    out, _ = summary(capsys, [*jobs, job("c", 0), job("c", 1, scenes=2)])
    (line,) = [line for line in out if line.startswith("agent=b less agent=a: success +")]
    assert "smallest shown" in line
    assert "McNemar, episodes as independent, p < 0.0001" in line
    assert any("agent=c less agent=a: not compared" in line for line in out)


def test_where_a_job_failed_each_network_is_a_setting(capsys, job):
    out, table = summary(capsys, [job("ours", 0, 0), job("ours", 1, 0), job("ours", 0, 1)])
    assert set(table["setting"]) == {
        f"agent=ours, split=var, train_seed={network}" for network in (0, 1)
    }
    assert any("not compared, seeds differ" in line for line in out)
    assert set(table["networks"]) == {1}


def test_few_apartments_have_a_reason(capsys, job):
    out, _ = summary(capsys, [job("ours", scenes=2), job("other", scenes=2)])
    assert any("without brackets: too few apartments" in line for line in out)
    assert not any("resampled" in line for line in out)
