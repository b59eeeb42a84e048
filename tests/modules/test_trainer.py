from pathlib import Path
from typing import Any

import pytest
import torch
from lightning.pytorch.callbacks import Callback
from small_training import build, recipe, weights

from avn.core.errors import UserError
from avn.modules.settings import BEST, LAST, TrainerConfig
from avn.modules.trainer import build_trainer, check_trainer
from avn.modules.training import fit


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("devices", 2),
        ("devices", [0, 1]),
        ("devices", "auto"),
        ("devices", True),
        ("devices", 0),
        ("accelerator", "abacus"),
        ("accelerator", "tpu"),
        ("precision", "64-true"),
        ("precision", "fp8"),
        ("max_epochs", 0),
        ("max_epochs", -1),
        ("overfit_batches", -1),
        ("fast_dev_run", -1),
        ("gradient_clip_val", 0.0),
        ("gradient_clip_val", float("nan")),
        ("profiler", "stopwatch"),
    ],
)
def test_a_setting_that_cannot_work_is_one_line_with_its_name(key: str, value: Any) -> None:
    with pytest.raises(UserError, match=rf"^trainer\.\w.*{key}|^trainer\.{key}") as caught:
        check_trainer(TrainerConfig(**{key: value}))
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_a_number_format_that_lightning_would_replace_is_refused() -> None:
    with pytest.raises(UserError, match="16-mixed is not possible with this device; give bf16-mix"):
        check_trainer(TrainerConfig(precision="16-mixed"))


@pytest.mark.parametrize("precision", ["32", "32-true", "bf16", "bf16-mixed"])
def test_number_formats_reach_the_trainer(precision: str, tmp_path: Path) -> None:
    check_trainer(TrainerConfig(precision=precision))
    trainer = build_trainer(TrainerConfig(precision=precision), 7, tmp_path)
    assert trainer.precision.startswith(precision)
    assert trainer.max_epochs == 7


def test_the_trainer_s_epochs_replace_those_of_the_recipe(tmp_path: Path) -> None:
    assert fit(*build(), tmp_path, trainer=TrainerConfig(max_epochs=2))["epochs"] == 2


def test_bfloat16_changes_weights_a_little(tmp_path: Path) -> None:
    # not down to maps of 1 x 1: of these, oneDNN gives gradients of NaN on CPUs with AMX
    net = {**recipe().net, "widths": [8, 8, 8, 8]}
    fit(*build(epochs=1, net=net), tmp_path / "whole")
    half_precision = TrainerConfig(precision="bf16-mixed")
    fit(*build(epochs=1, net=net), tmp_path / "half", trainer=half_precision)
    whole, half = weights(tmp_path / "whole" / BEST), weights(tmp_path / "half" / BEST)
    apart = [float((whole[key] - half[key]).float().abs().max()) for key in whole]
    assert 1e-6 < max(apart) < 0.1


def test_a_training_that_has_diverged_is_one_line_and_keeps_no_weights(tmp_path: Path) -> None:
    data, model = build(epochs=1)
    torch.nn.init.constant_(model.net.layers[-1].bias, float("nan"))
    with pytest.raises(UserError, match="sound network: its weights are not finite after epoch 1"):
        fit(data, model, tmp_path)
    assert not list(tmp_path.glob("*.ckpt"))


class _Norms(Callback):
    def __init__(self) -> None:
        self.found: list[float] = []

    def on_before_zero_grad(self, trainer: Any, pl_module: Any, optimizer: Any) -> None:
        gradients = [own.grad for own in pl_module.parameters() if own.grad is not None]
        if gradients:
            self.found.append(float(torch.cat([own.flatten() for own in gradients]).norm()))


def test_gradients_are_clipped_to_a_norm(tmp_path: Path) -> None:
    free, clipped = _Norms(), _Norms()
    fit(*build(epochs=1), tmp_path / "free", [free])
    fit(*build(epochs=1), tmp_path / "c", [clipped], trainer=TrainerConfig(gradient_clip_val=0.1))
    assert max(free.found) > 0.2
    assert max(clipped.found) <= 0.1 + 1e-6


class _Targets(Callback):
    def __init__(self) -> None:
        self.epochs: list[list[torch.Tensor]] = []

    def on_train_epoch_start(self, *args: Any) -> None:
        self.epochs.append([])

    def on_train_batch_end(self, *args: Any) -> None:
        self.epochs[-1].append(args[3]["target"].clone())


class _Losses(Callback):
    def __init__(self) -> None:
        self.found: list[float] = []

    def on_train_batch_end(self, trainer: Any, pl_module: Any, outputs: Any, *args: Any) -> None:
        self.found.append(float(outputs["loss"]))


def test_overfitting_repeats_a_few_batches_and_learns_them_by_heart(tmp_path: Path) -> None:
    trainer = TrainerConfig(overfit_batches=2, max_epochs=30)
    data, model = build(patience=1, flip_augmentation=False)
    seen, losses = _Targets(), _Losses()
    assert fit(data, model, tmp_path, [seen, losses], trainer=trainer)["epochs"] == 30
    first, *others = [torch.cat(epoch) for epoch in seen.epochs]
    assert len(first) == 32
    assert all(torch.equal(first, other) for other in others)
    assert losses.found[-1] < 0.2 * losses.found[0]


def test_a_trial_trains_one_batch_and_writes_nothing(tmp_path: Path) -> None:
    seen = _Targets()
    fit(*build(), tmp_path, [seen], trainer=TrainerConfig(fast_dev_run=1))
    assert [len(epoch) for epoch in seen.epochs] == [1]
    assert not list(tmp_path.rglob("*.*"))


def test_a_profile_is_a_file_in_the_folder(tmp_path: Path) -> None:
    fit(*build(epochs=1), tmp_path, trainer=TrainerConfig(profiler="simple"))
    assert "optimizer_step" in (tmp_path / "fit-profile.txt").read_text()


def test_going_on_from_another_training_equals_one_training(tmp_path: Path) -> None:
    fit(*build(schedule="constant"), tmp_path / "whole")
    fit(*build(schedule="constant", epochs=2), tmp_path / "half")
    found = fit(*build(schedule="constant"), tmp_path / "rest", start=tmp_path / "half" / LAST)
    assert found["epochs"] == 2
    whole, rest = (weights(tmp_path / name / LAST) for name in ("whole", "rest"))
    assert all(torch.equal(whole[key], rest[key]) for key in whole)


def test_a_training_that_goes_on_is_resumed_from_its_own_checkpoint(tmp_path: Path) -> None:
    fit(*build(epochs=1), tmp_path / "first")
    start = tmp_path / "first" / LAST
    found = fit(*build(epochs=3), tmp_path / "next", start=start)
    start.unlink()
    assert fit(*build(epochs=3), tmp_path / "next", start=start) == found


@pytest.mark.parametrize(
    ("changes", "epochs", "line"),
    [
        ({}, 4, "has 4 epochs, and the training ends after 4; give more, such as"),
        ({"epochs": 9}, 9, None),
        ({"epochs": 9, "sounds_per_pair": 2}, 9, None),
    ],
)
def test_a_start_may_be_of_another_recipe_but_not_at_its_end(
    tmp_path: Path, changes: dict[str, Any], epochs: int, line: str | None
) -> None:
    fit(*build(), tmp_path / "first")
    data, model = build(**changes, patience=20)
    arguments = data, model, tmp_path / "next"
    if line is None:
        assert fit(*arguments, start=tmp_path / "first" / LAST)["epochs"] == epochs - 4
        return
    with pytest.raises(UserError, match=line):
        fit(*arguments, start=tmp_path / "first" / LAST)


def test_a_start_of_another_network_is_refused(tmp_path: Path) -> None:
    data, model = build(epochs=1)
    fit(data, model, tmp_path / "first")
    path = tmp_path / "first" / LAST
    kept = torch.load(path, weights_only=True)
    name = next(iter(kept["state_dict"]))
    kept["state_dict"][name] = torch.zeros(1, 2, 3)
    torch.save(kept, path)
    with pytest.raises(UserError, match=f"of another network than sound_model .{name} is .1, 2, 3"):
        fit(*build(epochs=2), tmp_path / "next", start=path)
    path.write_text("no checkpoint")
    with pytest.raises(UserError, match=r"not a checkpoint of the sound network; give best.ckpt"):
        fit(*build(epochs=2), tmp_path / "other", start=path)
