"""Networks as stages: trained once for each recipe."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import lightning as L
from lightning.pytorch.callbacks import Callback
from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.core.files import written_whole
from avn.core.hashing import file_hash
from avn.modules import training
from avn.modules.network import Network
from avn.pipeline import scenes
from avn.pipeline.stage import make_once
from avn.reporting.model_card import write_card

METRICS, CHECKSUM = "metrics.json", "best.ckpt sha256"
Trained = TypeVar("Trained", bound=Network)


def trained(
    cfg: DictConfig,
    model: Trained,
    folder: Path,
    title: str,
    data: Callable[[], L.LightningDataModule],
    measure: Callable[[Trained, Any], dict[str, Any]] | None = None,
    callbacks: Sequence[Callback] = (),
    asked: bool = False,
    seconds: float = 0.0,
) -> Trained:
    """Give a network its weights; train it where they are missing.

    Parameters
    ----------
    model : Network
        Built from the config.
    folder : Path
        Where its checkpoints and `metrics.json` lie.
    title : str
        What it is, for the line that says that it is missing.
    data : callable
        Opens what it is trained on.
    measure : callable, optional
        Measures the trained network on the data; what it gives is added to the metrics.
    callbacks : sequence of Callback
        Further ones of the training, such as those that show figures in TensorBoard.
    asked : bool
        Whether it is the network that the user asked for, so that `auto=false` does not refuse it.
    seconds : float
        How long it takes on two cores, roughly.

    Raises
    ------
    UserError
        Where a checkpoint belongs to another config, or has changed since it was trained.
    """

    def fit() -> None:
        opened = data()
        metrics = training.fit(opened, model, folder, callbacks)
        metrics |= measure(model, opened) if measure else {}
        metrics[CHECKSUM] = file_hash(folder / training.BEST)
        with written_whole(folder / METRICS) as part:
            part.write_text(json.dumps(metrics, indent=1, sort_keys=True) + "\n")
        write_card(folder, title, apartments(cfg), dict(model.hparams), metrics)

    make_once(
        folder,
        title,
        done=(folder / METRICS).is_file,
        make=fit,
        auto=cfg.auto or asked,
        seconds=seconds,
    )
    best = folder / training.BEST
    training.load_weights(model, best)
    if read_metrics(folder).get(CHECKSUM) != file_hash(best):
        raise UserError(f"{best}: changed since it was trained; delete {folder} to train again")
    return model


def apartments(cfg: DictConfig) -> dict[str, str]:
    """What networks are trained and measured on, for their cards."""
    plans = scenes.plans(cfg)
    names = {part: ", ".join(plan.name for plan in plans[part]) for part in ("train", "validation")}
    setting = f"split `{cfg.split.name}`, acoustics `{cfg.acoustics.name}`"
    return {"setting": setting, "training apartments": names["train"]} | {
        "validation apartments": names["validation"]
    }


def read_metrics(folder: Path) -> dict[str, Any]:
    """What a training measured; raises `UserError` where the file is damaged."""
    try:
        return dict(json.loads((folder / METRICS).read_text()))
    except (OSError, ValueError) as error:
        raise UserError(f"{folder / METRICS}: damaged; delete {folder} to train again") from error
