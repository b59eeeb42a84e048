"""TensorBoard figures of an occupancy network: view, true and predicted local patch."""

from __future__ import annotations

from typing import Any

import lightning as L
import numpy as np
import torch
from lightning.pytorch.callbacks import Callback
from matplotlib.figure import Figure
from numpy.typing import NDArray

from avn.modules.attachments import tensorboard_writer


def local_patch_figure(
    views: NDArray[np.uint8],
    free: NDArray[np.bool_],
    visible: NDArray[np.bool_],
    estimate: NDArray[Any],
    title: str,
) -> Figure:
    """Draw views beside their true and predicted local patches.

    Parameters
    ----------
    views : (N, H, W, 3) uint8 array
        sRGB.
    free, visible : (N, 5, 5) bool arrays
        True for free and for visible cells. Row 0 is the nearest and drawn at the bottom;
        invisible cells are hatched.
    estimate : (N, 5, 5) array
        Predicted probability that a cell is free.
    title : str
    """
    figure = Figure(figsize=(7.2, 2.3 * len(views)), layout="constrained")
    axes = figure.subplots(len(views), 3, squeeze=False)
    names = ("view", "free cells", "estimate")
    for row, pictures in enumerate(zip(views, free.astype(float), estimate, strict=True)):
        for column, picture in enumerate(pictures):
            at = axes[row, column]
            style: dict[str, Any] = {"origin": "lower", "vmin": 0, "vmax": 1} if column else {}
            at.imshow(picture, **style)
            at.set_xticks([])
            at.set_yticks([])
            if not row:
                at.set_title(names[column])
        for y, x in np.argwhere(~visible[row]):
            for at in axes[row, 1:]:
                square = (
                    (x - 0.5, x + 0.5, x + 0.5, x - 0.5),
                    (y - 0.5, y - 0.5, y + 0.5, y + 0.5),
                )
                at.fill(*square, fill=False, hatch="///", edgecolor="0.6", linewidth=0)
    figure.suptitle(title)
    return figure


class LocalPatchFigures(Callback):
    """Callback that logs views of the validation apartments with local patches to TensorBoard.

    Parameters
    ----------
    every : int
        Epochs between figures; the first and last epoch are always logged.
    count : int
        Number of views.
    """

    def __init__(self, every: int = 5, count: int = 8) -> None:
        self.every, self.count = every, count

    def on_validation_epoch_end(self, trainer: L.Trainer, pl_module: Any) -> None:
        """Log one figure."""
        epoch = trainer.current_epoch + 1
        due = epoch % self.every == 0 or epoch in (1, trainer.max_epochs)
        if not due or (writer := tensorboard_writer(trainer)) is None:
            return
        views = trainer.datamodule.measured_views["validation"]  # type: ignore[attr-defined]
        chosen = torch.linspace(0, len(views) - 1, self.count).long().unique()
        batch = views.__getitems__(chosen.tolist())
        pictures = (batch["pictures"] * 255).round().byte().permute(0, 2, 3, 1)
        with torch.inference_mode():
            estimate = pl_module(pictures.to(pl_module.device)).cpu()[:, 0]
        figure = local_patch_figure(
            pictures.numpy(),
            batch["target"].bool().numpy(),
            batch["visible"].numpy(),
            estimate.numpy(),
            f"validation, epoch {epoch}",
        )
        writer.add_figure("windows", figure, trainer.global_step)
