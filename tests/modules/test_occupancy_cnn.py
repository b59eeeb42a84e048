from pathlib import Path
from typing import Any

import pytest
import torch
from lightning.pytorch.callbacks import Callback
from omegaconf import DictConfig
from small import option
from small_training import loggers
from synthetic_views import synthetic_views
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.settings import typed
from avn.datamodules.views import ViewData
from avn.modules.occupancy_cnn import OccupancyCnn
from avn.modules.settings import AugmentConfig
from avn.modules.training import BEST, LAST, fit, load_weights
from avn.reporting.local_patch_figures import LocalPatchFigures


def recipe(**changes: Any) -> DictConfig:
    given = {"epochs": 6, "batch": 16, "appearances": 2, "times": 4, "validation_views": 50}
    config = option("occupancy_model", "small", **given)
    config.net.widths, config.net.decoder, config.net.cell = [8, 8, 8, 8], 8, 16
    config.net.dropout, config.optimizer.lr = 0.0, 1e-2
    config.augment = AugmentConfig(colour=0.2, light=0.2, noise=0.02, blur=0, erase=0, shift=0)
    for key, value in changes.items():
        setattr(config, key, value)
    return config


def build(**changes: Any) -> tuple[ViewData, OccupancyCnn]:
    config = recipe(**changes)
    data = ViewData(
        [synthetic_views(120, 0, appearances=2)], [synthetic_views(60, 1)], typed(config)
    )
    return data, build_object("occupancy_model", config)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, OccupancyCnn, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("run")
    data, model = build()
    return (
        folder,
        model,
        fit(data, model, folder, [LocalPatchFigures()], loggers(folder, "tensorboard")),
    )


def test_what_is_painted_where_a_cell_is_is_learned(
    run: tuple[Path, OccupancyCnn, dict[str, Any]],
) -> None:
    metrics = run[2]
    assert metrics["auc/validation/all"] > 0.9
    assert metrics["accuracy/validation/visible"] > 0.8
    assert metrics["ece/validation/all"] < 0.1


def test_a_mirrored_view_has_the_mirrored_window(
    run: tuple[Path, OccupancyCnn, dict[str, Any]],
) -> None:
    model = run[1].eval()
    views = torch.from_numpy(synthetic_views(5, 2).rgb[0])
    with torch.inference_mode():
        straight, mirrored = model(views), model(views.flip(2))
    assert straight.shape == (5, 2, 5, 5)
    torch.testing.assert_close(mirrored, straight.flip(-1), atol=1e-5, rtol=1e-4)
    assert float((straight - straight.flip(-1)).abs().max()) > 0.1


def test_figures_are_of_calibrated_probabilities(
    run: tuple[Path, OccupancyCnn, dict[str, Any]],
) -> None:
    folder, model, _ = run
    # The calibration lies in the checkpoint and is read back with the weights.
    again = load_weights(build()[1], folder / BEST)
    assert torch.equal(again.calibration, model.calibration)
    assert not torch.equal(again.calibration, torch.tensor(((1.0, 0.0), (1.0, 0.0))))


def test_tensorboard_holds_scalars_and_windows(
    run: tuple[Path, OccupancyCnn, dict[str, Any]],
) -> None:
    folder, _, metrics = run
    tags = EventAccumulator(str(folder / "a-run"), size_guidance={"images": 0}).Reload().Tags()
    assert {name for name in metrics if "/" in name} | {"loss/steps"} <= set(tags["scalars"])
    assert "windows" in tags["images"]


class _InterruptedError(Exception):
    pass


class _StopIn(Callback):
    """Kills a training in the middle of an epoch."""

    def on_train_batch_start(self, trainer: Any, pl_module: Any, batch: Any, index: int) -> None:
        if trainer.current_epoch == 4 and index == 1:
            raise _InterruptedError


def test_resumed_training_is_the_uninterrupted_one(
    run: tuple[Path, OccupancyCnn, dict[str, Any]], tmp_path: Path
) -> None:
    folder, _, metrics = run
    data, model = build()
    model.configure_callbacks = lambda: [_StopIn()]
    with pytest.raises(_InterruptedError):
        fit(data, model, tmp_path)
    assert fit(*build(), tmp_path) == metrics
    for name in (BEST, LAST):
        first, second = (
            torch.load(path / name, weights_only=True)["state_dict"] for path in (folder, tmp_path)
        )
        assert all(torch.equal(first[key], second[key]) for key in first)


def test_checkpoint_of_another_config_is_one_line(
    run: tuple[Path, OccupancyCnn, dict[str, Any]],
) -> None:
    message = r"best.ckpt: .*another config \(occupancy_model.net.cell is 16 there, 8 here\)"
    other = recipe()
    other.net.cell = 8
    with pytest.raises(UserError, match=message):
        load_weights(build_object("occupancy_model", other), run[0] / BEST)


def test_hidden_cells_teach_nothing_with_visible_only() -> None:
    data, model = build(visible_only=True, depth_weight=0.0)
    assert model.monitor == "loss/validation/visible"
    batch = data.train_views.__getitems__(list(range(8)))
    log_odds = torch.zeros(8, 5, 5, requires_grad=True)
    loss = model._free_loss(log_odds, batch["target"], batch["visible"].float())
    (slope,) = torch.autograd.grad(loss, log_odds)
    assert torch.equal(slope != 0, batch["visible"])


def test_every_recipe_key_reaches_the_model() -> None:
    node = recipe()
    model = build_object("occupancy_model", node)
    assert set(model.hparams) - {"camera"} == set(node) - {"_target_", "ckpt_path"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"appearances": 0}, r"occupancy_model\.appearances is 0"),
        ({"depth_weight": -1.0}, r"occupancy_model\.depth_weight is -1"),
        ({"schedule": "linear"}, r"occupancy_model\.schedule is 'linear'"),
    ],
)
def test_bad_option_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        build_object("occupancy_model", recipe(**changes))


@pytest.mark.parametrize("scaled", [True, False])
def test_probabilities_are_calibrated_only_where_that_is_asked_for(scaled: bool) -> None:
    data, model = build(scaled=scaled)
    model.prepare(data)
    with torch.no_grad():
        for batch in data.val_dataloader()[0]:
            model.validation_step(batch, 0)
            model.validation_step(batch, 0, 1)
    model.on_validation_epoch_end()
    identity = torch.tensor([[1.0, 0.0], [1.0, 0.0]])
    assert torch.equal(model.calibration.cpu(), identity) == (not scaled)
