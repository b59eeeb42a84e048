"""Workers of a training: their order, their ends and what they share."""

import os
import signal
import time

import pytest
import torch
from small_actor_critics import training
from small_worlds import make_spec, random_tables

from avn.core.errors import UserError
from avn.rl import worker_pool
from avn.rl.checkpoints import LAST, read_checkpoint


def test_two_workers_in_turn_give_the_same_bytes_every_time_and_a_round_at_a_time(
    flat, rules, tmp_path
):
    options = {"workers": 2, "total_steps": 960, "validate_every": 480}
    spec = make_spec(random_tables([flat], rules), rules, **options)
    once, pieces = training(spec, tmp_path / "once"), training(spec, tmp_path / "pieces")
    once.run()
    pieces.run(rounds=1)
    again = training(spec, tmp_path / "pieces")
    again.run()
    assert torch.equal(once.shared.weights, again.shared.weights)
    alone = training(make_spec(spec.tables, rules, total_steps=960), tmp_path / "alone")
    alone.run()
    assert not torch.equal(once.shared.weights, alone.shared.weights)


def test_workers_that_run_freely_apply_all_their_gradients(flat, rules, tmp_path):
    options = {"workers": 2, "update_order": "free", "total_steps": 1200, "validate_every": 600}
    free = training(make_spec(random_tables([flat], rules), rules, **options), tmp_path / "free")
    free.run()
    assert free.steps == 1200
    assert {"entropy", "loss/value", "gradient_norm", "steps_per_second"} <= free.curve[-1].keys()


def test_a_worker_that_dies_ends_the_run_and_leaves_the_last_checkpoint_whole(
    flat, rules, tmp_path, monkeypatch
):
    options = {"workers": 2, "total_steps": 3_000_000, "validate_every": 300}
    spec = make_spec(random_tables([flat], rules), rules, **options)
    killed = []

    class Murderous(worker_pool.SpawnedPool):
        def run_chunk(self, updates, progress):
            if len(read_checkpoint(tmp_path / LAST, "a" * 64)["curve"]) == 2:
                killed.append(self._processes[1].pid)
                os.kill(self._processes[1].pid, signal.SIGKILL)
                time.sleep(0.1)
            return super().run_chunk(updates, progress)

    monkeypatch.setattr("avn.rl.training.start_pool", Murderous)
    with pytest.raises(UserError, match=r"worker 1 died.*the last checkpoint is whole"):
        training(spec, tmp_path).run()
    assert killed
    assert len(read_checkpoint(tmp_path / LAST, "a" * 64)["curve"]) == 2
    assert training(spec, tmp_path).steps == 300


def test_workers_share_files_and_no_shared_memory(flat, rules, tmp_path, monkeypatch):
    """A container has 64 MB of shared memory, and the tables of a training may have more."""

    def refuse(*_):
        raise RuntimeError("unable to write to shared memory")

    for name in ("_share_fd_cpu_", "_share_filename_cpu_"):
        monkeypatch.setattr(torch.UntypedStorage, name, refuse)
    spec = make_spec(random_tables([flat], rules), rules, workers=2, total_steps=120)
    run = training(spec, tmp_path)
    before = run.shared.weights.clone()
    run.run()
    assert int(run.shared.updates) == 4  # 120 steps of 6 environments and rollouts of 5
    assert not torch.equal(run.shared.weights, before)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_a_machine_without_semaphores_is_one_line(flat, rules, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(worker_pool, "_locks", refuse)
    spec = make_spec(random_tables([flat], rules), rules, workers=2, total_steps=120)
    with pytest.raises(UserError, match=r"give algorithm\.workers=1"):
        training(spec, tmp_path).run()


def test_what_a_worker_refuses_is_said_in_one_line(flat, rules, tmp_path):
    spec = make_spec(random_tables([flat], rules), rules, workers=2, total_steps=600, maps=1)
    object.__setattr__(spec, "map_size", 5)  # a map that no agent fits on
    with pytest.raises(UserError, match=r"mapper\.size|baseline\.map_width"):
        training(spec, tmp_path).run()


def test_more_workers_than_cores_are_warned_of(flat, rules, capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    monkeypatch.setattr(worker_pool, "SpawnedPool", lambda *_: None)
    spec = make_spec(random_tables([flat], rules), rules, workers=2)
    worker_pool.start_pool(spec, None, [], tmp_path)
    assert "2 workers share 1 cores" in capsys.readouterr().out
