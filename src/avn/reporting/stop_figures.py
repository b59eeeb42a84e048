"""TensorBoard figures of a stop classifier: ROC curve, calibration, map of probabilities."""

from __future__ import annotations

from typing import Any

import lightning as L
import numpy as np
import torch
from lightning.pytorch.callbacks import Callback
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL, FloorPlan
from avn.modules.attachments import tensorboard_writer
from avn.reporting.sound_figures import draw_plan


def reliability(axes: Axes, probability: NDArray[Any], label: NDArray[Any], bins: int = 15) -> None:
    """Draw a reliability diagram: observed frequency against predicted probability.

    Parameters
    ----------
    axes : Axes
    probability : (N,) array
        Predictions, 0 to 1.
    label : (N,) array
        Truth, 0 or 1.
    bins : int
        Number of bins of equal width.
    """
    which = np.minimum((probability * bins).astype(int), bins - 1)
    counts = np.bincount(which, minlength=bins)
    filled = counts > 0
    prediction = np.bincount(which, probability, bins)[filled] / counts[filled]
    found = np.bincount(which, label, bins)[filled] / counts[filled]
    axes.plot((0, 1), (0, 1), color="0.7")
    axes.plot(prediction, found, "o-")
    axes.set_xlabel("predicted probability")
    axes.set_ylabel("observed frequency")
    axes.set_aspect("equal")
    axes.set_title("calibration")


def roc(axes: Axes, probability: NDArray[Any], label: NDArray[Any]) -> None:
    """Draw the ROC curve.

    Parameters
    ----------
    axes : Axes
    probability : (N,) array
        Predictions, 0 to 1.
    label : (N,) array
        Truth, 0 or 1.
    """
    order = np.argsort(-probability, kind="stable")
    hits, alarms = np.cumsum(label[order]), np.cumsum(1 - label[order])
    axes.plot(alarms / max(1, alarms[-1]), hits / max(1, hits[-1]))
    axes.set_xlabel("false positive rate")
    axes.set_ylabel("true positive rate")
    axes.set_aspect("equal")
    axes.set_title("ROC")


def curves_figure(probability: NDArray[Any], label: NDArray[Any], title: str) -> Figure:
    """Draw ROC curve and reliability diagram side by side.

    Parameters
    ----------
    probability : (N,) array
        Predictions, 0 to 1.
    label : (N,) array
        Truth, 0 or 1.
    title : str
    """
    figure = Figure(figsize=(8, 4), layout="constrained")
    roc(figure.add_subplot(1, 2, 1), probability, label)
    reliability(figure.add_subplot(1, 2, 2), probability, label)
    figure.suptitle(title)
    return figure


def stop_map(
    plan: FloorPlan,
    lattice: NDArray[Any],
    probability: NDArray[Any],
    goal: NDArray[Any],
    title: str,
) -> Figure:
    """Draw the mean predicted goal probability of each cell over headings.

    Parameters
    ----------
    plan : FloorPlan
    lattice : (C, 2) integer array
        Cells in steps of the grid.
    probability : (4 C,) array
        Predictions by state, 0 to 1.
    goal : (C,) bool array
        True for goal cells.
    title : str
    """
    figure = Figure(figsize=(7, 6), layout="constrained")
    axes = figure.add_subplot()
    draw_plan(axes, plan)
    east, north = (lattice * CELL).T
    mean = probability.reshape(-1, 4).mean(axis=1)
    drawn = axes.scatter(east, north, c=mean, vmin=0, vmax=1, s=40, cmap="viridis", zorder=3)
    style: dict[str, Any] = {"facecolors": "none", "edgecolors": "red", "zorder": 4}
    axes.scatter(east[goal], north[goal], s=110, label="goal", **style)
    figure.colorbar(drawn, ax=axes, label="probability")
    axes.set_title(title)
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.1), frameon=False)
    return figure


class StopFigures(Callback):
    """Callback that logs figures of the first validation apartment's first source to TensorBoard.

    Parameters
    ----------
    every : int
        Epochs between figures; the first and last epoch are always logged.
    sounds : int
        Number of sounds of which there are figures, the first ones.
    """

    def __init__(self, every: int = 5, sounds: int = 3) -> None:
        self.every, self.sounds = every, sounds

    def on_validation_epoch_end(self, trainer: L.Trainer, pl_module: Any) -> None:
        """Log a map for each of the first sounds, and the curves over them."""
        epoch = trainer.current_epoch + 1
        due = epoch % self.every == 0 or epoch in (1, trainer.max_epochs)
        if not due or (writer := tensorboard_writer(trainer)) is None:
            return
        data: Any = trainer.datamodule  # type: ignore[attr-defined]
        clips, scene = data.measured_clips["validation"], data.scenes["validation"][0]
        # The states of source 0 in the first apartment come first.
        states = torch.arange(4 * len(scene.grid.lattice))
        at_goal = clips.target[states].eq(0).numpy()
        found = []
        for index, sound in enumerate(clips.sounds.names[: self.sounds]):
            items = clips.item(states, torch.tensor(index), 0)
            batches = [clips.__getitems__(part.tolist())["clips"] for part in items.split(128)]
            with torch.inference_mode():
                prediction = torch.cat(
                    [pl_module(batch.to(pl_module.device)).cpu() for batch in batches]
                )
            found.append(prediction.numpy())
            title = f"{scene.name}, {sound}, epoch {epoch}"
            figure = stop_map(scene.plan, scene.grid.lattice, found[-1], at_goal[::4], title)
            writer.add_figure(f"stops/{sound}", figure, trainer.global_step)
        label = np.tile(at_goal, len(found)).astype(float)
        curves = curves_figure(np.concatenate(found), label, f"{scene.name}, epoch {epoch}")
        writer.add_figure("curves", curves, trainer.global_step)
