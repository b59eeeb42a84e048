"""TensorBoard figures of a sound network: locations on a floor plan, spectrograms, audio."""

from __future__ import annotations

import io
import math
import wave
from typing import Any

import lightning as L
import numpy as np
import torch
from lightning.pytorch.callbacks import Callback
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from tensorboard.compat.proto.summary_pb2 import Summary  # type: ignore[import-untyped]
from torch import Tensor

from avn.apartments.floor_plan import CELL, DOOR_WIDTH, WALL_THICKNESS, FloorPlan
from avn.modules.attachments import tensorboard_writer

# Colours of states with the source in sight (True) and out of sight (False).
COLOURS = {True: "tab:blue", False: "tab:orange"}


def draw_plan(axes: Axes, plan: FloorPlan) -> None:
    """Draw walls, doorways and furniture of a plan, in metres."""
    for piece in plan.furniture:
        x0, y0, x1, y1 = piece.bounds
        axes.fill((x0, x1, x1, x0), (y0, y0, y1, y1), color="0.9", zorder=0)
    thick = 72 * WALL_THICKNESS / 4
    for room in plan.rooms:
        corners = ((room.x0, room.x1, room.x1, room.x0), (room.y0, room.y0, room.y1, room.y1))
        axes.fill(*corners, fill=False, edgecolor="black", linewidth=thick, zorder=1)
    for door in plan.doorways:
        half = DOOR_WIDTH / 2
        along = ((door.x - half, door.x + half), (door.y, door.y))
        across = ((door.x, door.x), (door.y - half, door.y + half))
        axes.plot(*(along if door.along == "x" else across), color="white", lw=2 * thick, zorder=2)
    axes.set_aspect("equal")
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")


def to_world(
    relative: NDArray[Any], places: NDArray[Any], headings: NDArray[Any]
) -> NDArray[np.float64]:
    """Transform locations from the agents' frames to east and north.

    Parameters
    ----------
    relative : (N, 2) array
        Metres right and in front of the agent.
    places : (N, 2) array
        East and north of the agent in metres.
    headings : (N,) integer array
        0 north, 1 east, 2 south, 3 west.

    Returns
    -------
    (N, 2) float64
        East and north in metres.
    """
    right, front = relative[:, 0], relative[:, 1]
    east = np.choose(headings, (right, front, -right, -front))
    north = np.choose(headings, (front, -right, -front, right))
    return places + np.stack((east, north), 1)


def location_figure(
    plan: FloorPlan,
    lattice: NDArray[Any],
    estimate: NDArray[Any],
    target: NDArray[Any],
    in_sight: NDArray[np.bool_],
    title: str,
) -> Figure:
    """Draw the estimated locations of one source from all states, and the true one.

    Parameters
    ----------
    plan : FloorPlan
    lattice : (C, 2) integer array
        Cells in steps of the grid.
    estimate, target : (4 C, 2) arrays
        Metres right and in front of the agent, by state.
    in_sight : (4 C,) bool array
        True if the source is in sight of the state.
    title : str

    Returns
    -------
    Figure
        A dot for the estimate of each state, a star at the source.
    """
    states = np.arange(len(estimate))
    places, headings = lattice[states // 4] * CELL, states % 4
    estimated = to_world(estimate, places, headings)
    source = to_world(target, places, headings)[0]
    error = np.linalg.norm(estimate - target, axis=1)
    figure = Figure(figsize=(7, 6), layout="constrained")
    axes = figure.add_subplot()
    draw_plan(axes, plan)
    for seen, label in ((True, "in sight"), (False, "out of sight")):
        chosen = in_sight == seen
        if chosen.any():
            text = f"estimates {label}: median error {np.median(error[chosen]):.1f} m"
            style: dict[str, Any] = {"alpha": 0.6, "color": COLOURS[seen], "zorder": 3}
            axes.scatter(estimated[chosen, 0], estimated[chosen, 1], s=9, label=text, **style)
    axes.plot(*source, "*", markersize=16, color="red", mec="black", label="true", zorder=4)
    axes.set_title(title)
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.1), frameon=False)
    return figure


def frequency_ticks(rate: int, bands: int) -> tuple[list[float], list[str]]:
    """Return rows and labels (kHz) of some frequencies in a mel spectrogram, lowest band last.

    `rate` is the sampling rate in Hz, `bands` the number of rows.
    """
    shown = [hertz for hertz in (500, 2000, 6000) if hertz < rate / 2]
    # the centres of the bands are evenly spaced in mel; see `avn.modules.spectrogram.band_weights`
    shares = [math.log1p(hertz / 700) / math.log1p(rate / 1400) for hertz in shown]
    places = [bands - share * (bands + 1) for share in shares]
    return places, [f"{hertz / 1000:g}" for hertz in shown]


def spectrogram_figure(pictures: Tensor, title: str) -> Figure:
    """Draw the input channels (channels, bands, frames) of the network for one clip."""
    names = ("left", "right", "coherence, real", "coherence, imaginary")
    figure = Figure(figsize=(3.2 * len(pictures), 3.2), layout="constrained")
    for index, (picture, name) in enumerate(zip(pictures, names, strict=False)):
        axes = figure.add_subplot(1, len(pictures), index + 1)
        ends = pictures[:2].aminmax() if index < 2 else (-1.0, 1.0)
        image = axes.imshow(
            picture, origin="lower", aspect="auto", vmin=float(ends[0]), vmax=float(ends[1])
        )
        axes.set_title(name)
        axes.set_xlabel("frame")
        axes.set_ylabel("band")
        if index in (1, 3):
            figure.colorbar(image, ax=axes, label="10 dB" if index == 1 else None)
    figure.suptitle(title)
    return figure


def stereo(clip: Tensor, rate: int) -> Summary.Audio:
    """Encode a clip (2, n) as TensorBoard audio with two channels and a peak of 0.9."""
    scaled = clip * (0.9 * 32767 / clip.abs().max().clamp_min(1e-9))
    content = io.BytesIO()
    with wave.open(content, "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(scaled.round().T.contiguous().numpy().astype("<i2").tobytes())
    return Summary.Audio(
        sample_rate=rate,
        num_channels=2,
        length_frames=clip.shape[1],
        encoded_audio_string=content.getvalue(),
        content_type="audio/wav",
    )


class SoundFigures(Callback):
    """Callback that logs figures and audio of the first validation apartment to TensorBoard.

    Parameters
    ----------
    every : int
        Epochs between figures of locations; the first and last epoch are always logged.
    sounds : int
        Number of sounds of which there are figures, the first ones.
    """

    def __init__(self, every: int = 5, sounds: int = 3) -> None:
        self.every, self.sounds = every, sounds

    def on_train_start(self, trainer: L.Trainer, pl_module: Any) -> None:
        """Log spectrograms and audio of the first sounds, in sight and out of sight."""
        writer = tensorboard_writer(trainer)
        if trainer.current_epoch or writer is None:
            return
        clips = trainer.datamodule.measured_clips["validation"]  # type: ignore[attr-defined]
        for seen, sight in ((True, "in sight"), (False, "out of sight")):
            pairs = torch.nonzero(clips.in_sight == seen)[:1, 0]
            for index, sound in enumerate(clips.sounds.names[: self.sounds] if len(pairs) else ()):
                batch = clips.__getitems__(clips.item(pairs, torch.tensor(index), 0).tolist())
                right, front = batch["target"][0, -2:].tolist()  # locations stand last
                title = f"{sound} {sight}: {right:+.1f} m right, {front:+.1f} m front"
                pictures = pl_module.spectrogram(batch["clips"].to(pl_module.device))[0].cpu()
                tag = f"{sound}/{sight.replace(' ', '_')}"
                writer.add_figure(f"spectrogram/{tag}", spectrogram_figure(pictures, title))
                audio = Summary.Value(
                    tag=f"audio/{tag}", audio=stereo(batch["clips"][0], pl_module.spectrogram.rate)
                )
                assert writer.file_writer is not None
                writer.file_writer.add_summary(Summary(value=[audio]), 0)

    def on_validation_epoch_end(self, trainer: L.Trainer, pl_module: Any) -> None:
        """Log estimated and true locations of the first source, one figure per sound."""
        epoch = trainer.current_epoch + 1
        due = epoch % self.every == 0 or epoch in (1, trainer.max_epochs)
        if not due or (writer := tensorboard_writer(trainer)) is None:
            return
        data: Any = trainer.datamodule  # type: ignore[attr-defined]
        clips, scene = data.measured_clips["validation"], data.scenes["validation"][0]
        # The states of source 0 in the first apartment come first.
        states = torch.arange(4 * len(scene.grid.lattice))
        for index, sound in enumerate(clips.sounds.names[: self.sounds]):
            items = clips.item(states, torch.tensor(index), 0)
            batches = [clips.__getitems__(part.tolist()) for part in items.split(128)]
            with torch.inference_mode():
                estimates = [
                    pl_module(batch["clips"].to(pl_module.device)).cpu() for batch in batches
                ]
            figure = location_figure(
                scene.plan,
                scene.grid.lattice,
                torch.cat(estimates).numpy(),
                torch.cat([batch["target"][:, -2:] for batch in batches]).numpy(),
                torch.cat([batch["in_sight"] for batch in batches]).numpy(),
                f"{scene.name}, {sound}, epoch {epoch}",
            )
            writer.add_figure(f"locations/{sound}", figure, trainer.global_step)
