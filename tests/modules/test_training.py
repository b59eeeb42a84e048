import os
import signal
from pathlib import Path
from typing import Any

import pytest
import torch
from lightning.pytorch.callbacks import Callback
from small_training import build, loggers, weights
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from avn.core.errors import UserError
from avn.core.signals import exit_code_of
from avn.modules.training import BEST, LAST, fit, load_weights
from avn.reporting.sound_figures import SoundFigures


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("run")
    return folder, fit(*build(), folder, [SoundFigures()], loggers(folder, "tensorboard"))


@pytest.mark.parametrize("rate", [8000, 16000, 48000])
def test_training_lowers_the_error(tmp_path: Path, rate: int) -> None:
    metrics = fit(*build(rate, epochs=10), tmp_path)
    assert metrics["loss/train"] < 0.8 * error(rate)
    assert metrics["bearing_deg/train/all/all"] < 45  # 90 is chance


def test_training_ends_after_its_epochs(run: tuple[Path, dict[str, Any]]) -> None:
    assert run[1]["epochs"] == 4


def error(rate: int) -> float:
    """Squared error on the training clips of an untrained network."""
    data, untrained = build(rate)
    batches = list(data.val_dataloader()[1])
    with torch.inference_mode():
        heard = torch.cat([untrained.eval().estimate(batch["pictures"]) for batch in batches])
    target = torch.cat([batch["target"] for batch in batches])
    return float(torch.nn.functional.mse_loss(heard, target))


def test_metrics_are_by_split_sight_and_sound(run: tuple[Path, dict[str, Any]]) -> None:
    _, metrics = run
    for split in ("validation", "train"):
        for sight in ("in_sight", "out_of_sight", "all"):
            for sound in ("hiss", "hum", "all"):
                assert metrics[f"error_m/{split}/{sight}/{sound}"] > 0
                assert 0 <= metrics[f"bearing_deg/{split}/{sight}/{sound}"] <= 180


def test_tensorboard_holds_scalars_figures_and_audio(run: tuple[Path, dict[str, Any]]) -> None:
    folder, metrics = run
    events = EventAccumulator(
        str(folder / "a-run"), size_guidance={"images": 0, "audio": 0}
    ).Reload()
    tags = events.Tags()
    wanted = {name for name in metrics if "/" in name} | {"loss/steps"}
    assert wanted <= set(tags["scalars"])
    assert {"locations/hiss", "spectrogram/hum/in_sight"} <= set(tags["images"])
    assert {"audio/hiss/in_sight", "audio/hiss/out_of_sight"} <= set(tags["audio"])
    series = [event.value for event in events.Scalars("error_m/validation/all/all")]
    assert len(series) == 4
    assert min(series) == pytest.approx(metrics["error_m/validation/all/all"])


class _InterruptedError(Exception):
    pass


class _StopIn(Callback):
    """Kills a training in the middle of an epoch."""

    def __init__(self, epoch: int) -> None:
        self.epoch = epoch

    def on_train_batch_start(self, trainer: Any, pl_module: Any, batch: Any, index: int) -> None:
        if trainer.current_epoch == self.epoch and index == 1:
            raise _InterruptedError


def test_resumed_training_is_the_uninterrupted_one(
    run: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    folder, metrics = run
    data, model = build()
    model.configure_callbacks = lambda: [_StopIn(3)]
    with pytest.raises(_InterruptedError):
        fit(data, model, tmp_path)
    assert torch.load(tmp_path / LAST, weights_only=True)["epoch"] == 2
    resumed = fit(*build(), tmp_path)
    assert resumed == metrics
    for name in (BEST, LAST):
        first, second = weights(folder / name), weights(tmp_path / name)
        assert all(torch.equal(first[key], second[key]) for key in first)


class _SignalIn(_StopIn):
    """Sends a signal to the process in the middle of an epoch."""

    def __init__(self, epoch: int, number: signal.Signals) -> None:
        super().__init__(epoch)
        self.number = number

    def on_train_batch_start(self, *args: Any) -> None:
        try:
            super().on_train_batch_start(*args)
        except _InterruptedError:
            os.kill(os.getpid(), self.number)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_training_that_a_signal_stops_goes_on_later(
    run: tuple[Path, dict[str, Any]], tmp_path: Path, number: signal.Signals
) -> None:
    folder, metrics = run
    data, model = build()
    model.configure_callbacks = lambda: [_SignalIn(3, number)]
    assert exit_code_of("avn.train", lambda: bool(fit(data, model, tmp_path))) == 128 + number
    assert torch.load(tmp_path / LAST, weights_only=True)["epoch"] == 2
    assert fit(*build(), tmp_path) == metrics
    first, second = weights(folder / BEST), weights(tmp_path / BEST)
    assert all(torch.equal(first[key], second[key]) for key in first)


def test_ctrl_c_outside_of_a_command_is_a_keyboard_interrupt(tmp_path: Path) -> None:
    data, model = build(epochs=1)
    model.configure_callbacks = lambda: [_SignalIn(0, signal.SIGINT)]
    handler = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(KeyboardInterrupt):
            fit(data, model, tmp_path)
    finally:
        signal.signal(signal.SIGINT, handler)


def test_a_batch_system_s_tasks_are_not_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("SLURM_NTASKS", "4"), ("SLURM_JOB_NAME", "job"), ("SLURM_PROCID", "0")):
        monkeypatch.setenv(name, value)
    assert fit(*build(epochs=1), tmp_path)["epochs"] == 1


def test_finished_training_is_not_repeated(run: tuple[Path, dict[str, Any]]) -> None:
    folder, metrics = run
    written = (folder / LAST).stat().st_mtime_ns
    assert fit(*build(), folder) == metrics
    assert (folder / LAST).stat().st_mtime_ns == written


def test_training_stops_early_without_progress(tmp_path: Path) -> None:
    data, model = build(epochs=5, patience=1)
    model.hparams["optimizer"]["lr"] = 0.0
    # With a rate of 0 the weights never change; batch normalisation alone moves the error.
    assert fit(data, model, tmp_path)["epochs"] < 5


def test_best_weights_are_the_model_s_afterwards(run: tuple[Path, dict[str, Any]]) -> None:
    model = load_weights(build()[1], run[0] / BEST)
    assert not model.training
    saved = weights(run[0] / BEST)
    assert all(torch.equal(saved[key], value) for key, value in model.state_dict().items())


def test_checkpoint_of_another_config_is_refused(run: tuple[Path, dict[str, Any]]) -> None:
    other = build(train_seed=3)
    message = r"best.ckpt: .*another config \(sound_model.train_seed is 0 there, 3 here\)"
    with pytest.raises(UserError, match=message):
        load_weights(other[1], run[0] / BEST)
    with pytest.raises(UserError, match=r"last.ckpt: .*another config"):
        fit(*other, run[0])


@pytest.mark.parametrize("damage", ["missing", "cut", "text", "other"])
def test_damaged_checkpoint_is_named(
    run: tuple[Path, dict[str, Any]], tmp_path: Path, damage: str
) -> None:
    path = tmp_path / BEST
    whole = (run[0] / BEST).read_bytes()
    if damage == "cut":
        path.write_bytes(whole[: len(whole) // 2])
    elif damage == "text":
        path.write_text("not a checkpoint")
    elif damage == "other":
        torch.save({"weights": torch.zeros(3)}, path)
    with pytest.raises(UserError) as caught:
        load_weights(build()[1], path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
