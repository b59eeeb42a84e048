"""Films of episodes: view, sound and beliefs of the agent, one second per action."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import soundfile
import torch
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.modules.spectrogram import Spectrogram
from avn.navigation.trace import BeliefTrace, Trace
from avn.reporting.belief_figures import DOTS, SOURCE, WALKED, draw_posterior, posterior_areas
from avn.reporting.sound_figures import draw_plan, frequency_ticks
from avn.reporting.trajectory_figures import (
    DISTRACTOR,
    draw_apartment,
    extent,
    outcome,
    plan_of,
    title_of,
)

# Frames per second. Only the cursor on the spectrograms moves within a second.
FPS = 5
SIZE = (1280, 720)
ACTIONS = ("forward", "backward", "turn left", "turn right", "Stop")


def write_film(
    path: Path,
    trace: Trace,
    name: str,
    views: NDArray[np.uint8],
    clips: Tensor,
    track: NDArray[np.float32],
    speed: float = 1.0,
    note: str = "",
) -> None:
    """Write a film of an episode of T actions as MP4, (T + 1) / speed seconds long.

    Parameters
    ----------
    path : Path
    trace : Trace
    name : str
        Name of the run.
    views : (T + 1, H, W, 3) uint8
        View at each step, sRGB.
    clips : (T + 1, 2, rate) float32 tensor
        Binaural clip at each step, for the spectrograms.
    track : (rate (T + 1), 2) float32
        Soundtrack; see `avn.pipeline.observed.soundtrack`.
    speed : float
        Steps per second. The pitch of the sound does not change.
    note : str
        Warning about the run, such as `avn.reporting.world.TRIAL_NOTE`.

    Raises
    ------
    UserError
        If the film cannot be encoded.
    """
    with atomic_write(path) as part, tempfile.TemporaryDirectory() as folder:
        wave = Path(folder) / "sound.wav"
        try:
            soundfile.write(wave, track, clips.shape[-1], subtype="PCM_16")
        except soundfile.SoundFileError as error:
            raise UserError(f"{wave}: the sound cannot be written ({error}); free space") from error
        writer = imageio_ffmpeg.write_frames(
            str(part),
            SIZE,
            fps=FPS * speed,
            codec="libx264",
            quality=7,
            audio_path=str(wave),
            audio_codec="aac",
            ffmpeg_log_level="error",
            # the format is explicit because the temporary file has another suffix
            output_params=[
                *(["-filter:a", f"atempo={speed:g}"] if speed != 1 else []),
                *("-ar", "48000", "-b:a", "192k", "-movflags", "+faststart", "-f", "mp4"),
            ],
        )
        try:
            writer.send(None)
            for frame in frames(trace, name, views, clips, note):
                writer.send(np.ascontiguousarray(frame))
        except OSError as error:
            reason = " ".join(str(error).split())[-200:]
            raise UserError(f"{path}: the film cannot be encoded ({reason})") from error
        finally:
            writer.close()


def frames(
    trace: Trace, name: str, views: NDArray[np.uint8], clips: Tensor, note: str = ""
) -> Iterator[NDArray[np.uint8]]:
    """Generate the frames of a film, `FPS` per step.

    Parameters
    ----------
    trace : Trace
    name : str
        Name of the run.
    views : (T + 1, H, W, 3) uint8
        View at each step, sRGB.
    clips : (T + 1, 2, rate) float32 tensor
        Binaural clip at each step, one second long.
    note : str
        Warning about the run, in the last line.

    Yields
    ------
    (720, 1280, 3) uint8
        sRGB.
    """
    stage = _Stage(trace, name, views, clips)
    stage.add_note(note)
    for step in range(len(trace.state)):
        picture = stage.draw(step)
        for beat in range(FPS):
            yield stage.with_cursor(picture, beat / FPS)


class _Stage:
    """Figure on which all frames are drawn."""

    def __init__(self, trace: Trace, name: str, views: NDArray[np.uint8], clips: Tensor) -> None:
        self.trace, self.views = trace, views
        self.figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100, facecolor="white")
        self.canvas = FigureCanvasAgg(self.figure)
        self.view = self._panel(12, 258, 450, 450)
        self.picture = self.view.imshow(views[0], interpolation="bicubic")
        rate = clips.shape[-1]
        columns = max(count for count in range(1, 101) if rate % count == 0)
        spectrogram = Spectrogram(rate, scale="mel", frames=columns, interaural=False)
        # low frequencies at the bottom
        self.pictures = torch.flip(spectrogram(clips), dims=(2,)).numpy()
        low, high = np.quantile(self.pictures, (0.02, 0.998))
        self.ears = [self._panel(66, 140, 396, 102), self._panel(66, 30, 396, 102)]
        self.sounds = []
        for ear, (axes, word) in enumerate(zip(self.ears, ("left", "right"), strict=True)):
            style: dict[str, Any] = {"aspect": "auto", "cmap": "magma", "vmin": low, "vmax": high}
            self.sounds.append(axes.imshow(self.pictures[0, ear], **style))
            axes.set_ylabel(f"{word} ear, kHz", fontsize=9)
            places, labels = frequency_ticks(rate, spectrogram.bands)
            axes.set_yticks(places, labels, fontsize=8)
        ends = [-0.5, columns / 2 - 0.5, columns - 0.5]
        self.ears[1].set_xticks(ends, ["0", "0.5", "1 s"], fontsize=8)
        for axes in self.ears:
            axes.tick_params(length=2, pad=1)
        self.map = self._panel(484, 60, 784, 560)
        self._draw_map()
        self.figure.text(484 / 1280, 690 / 720, f"{name}", fontsize=15, weight="bold", va="center")
        self.figure.text(484 / 1280, 660 / 720, title_of(trace), fontsize=12, va="center")
        self.caption = self.figure.text(484 / 1280, 630 / 720, "", fontsize=12, va="center")
        self._legend()

    def _panel(self, left: int, bottom: int, width: int, height: int) -> Axes:
        """Add axes without ticks; position and size are in pixels."""
        (w, h) = SIZE
        axes: Axes = self.figure.add_axes((left / w, bottom / h, width / w, height / h))
        axes.set(xticks=[], yticks=[])
        return axes

    def _draw_map(self) -> None:
        trace, axes = self.trace, self.map
        beliefs = trace.beliefs
        free = None if beliefs is None else beliefs.free
        self.belief = None
        if beliefs is not None and free is not None:
            style: dict[str, Any] = {"cmap": "BrBG", "vmin": 0, "vmax": 255, "zorder": -1}
            place = extent(beliefs.low, free.shape[1:])
            self.belief = axes.imshow(free[0], origin="lower", extent=place, alpha=0.75, **style)
        self.posterior = None
        if beliefs is not None and beliefs.posterior is not None:
            self.posterior = draw_posterior(axes, beliefs, 0)
        plan = plan_of(trace)
        if self.belief is None or plan is None:
            draw_apartment(axes, trace.scene)
        else:
            draw_plan(axes, plan)
            for piece in plan.furniture:
                x0, y0, x1, y1 = piece.bounds
                box = Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, ec="0.35", lw=0.7)
                axes.add_patch(box)
            for patch in axes.patches:
                if patch.get_zorder() == 0:
                    patch.set_visible(False)
            axes.set(xlabel="", ylabel="", xticks=[], yticks=[])
        centres = trace.scene.grid.centres
        (x0, y0), (x1, y1) = centres.min(0) - 1.2, centres.max(0) + 1.2
        axes.set(xlim=(x0, x1), ylim=(y0, y1))
        self.recalled = None
        if (
            beliefs is not None
            and beliefs.retrieved is not None
            and trace.exploration_trajectory is not None
        ):
            walk = centres[trace.exploration_trajectory // HEADINGS]
            axes.plot(*walk.T, color="0.45", lw=0.9, zorder=7)
            (self.recalled,) = axes.plot([], [], "o", color="#7b3294", ms=8, alpha=0.8, zorder=8)
        if trace.distractor is not None:
            axes.plot(*trace.distractor, "D", zorder=12, **DISTRACTOR)
        star: dict[str, Any] = {"color": "#ffb000", "mec": "black", "markersize": 17}
        (self.source,) = axes.plot([], [], "*", zorder=12, **star)
        (self.path,) = axes.plot([], [], color=WALKED, lw=2.6, zorder=9)
        (self.bumps,) = axes.plot([], [], "x", color="black", markersize=6, zorder=10)
        (self.agent,) = axes.plot([], [], color="white", mec=WALKED, mew=2.5, ms=18, zorder=11)
        (self.ray,) = axes.plot([], [], color=SOURCE, lw=1, ls=":", zorder=8)
        (self.estimate,) = axes.plot(
            [], [], "P", color=SOURCE, mec="white", markersize=14, zorder=13
        )

    def _legend(self) -> None:
        words = ["star: source", "triangle: agent, pink: its path"]
        if self.trace.distractor is not None:
            words.append("grey diamond: distractor")
        if self.trace.collided.any():
            words.append("black x: collision")
        if self.trace.source_estimates is not None:
            words.append("blue plus: source estimate")
        second = []
        if self.belief is not None:
            second.append("belief: green free, brown blocked")
        if self.posterior is not None:
            second.append(f"blue dots: {DOTS}")
        if self.recalled is not None:
            second.append("memory: grey exploration walk, purple most similar entries")
        for height, line in ((40, words), (24, second)):
            place = (484 / 1280, height / 720)
            self.figure.text(*place, "    ".join(line), fontsize=9, color="0.3")

    def add_note(self, note: str) -> None:
        """Write a warning into the last line of all frames."""
        self.figure.text(484 / 1280, 7 / 720, note, fontsize=9, color="#8a5a00")

    def draw(self, step: int) -> NDArray[np.uint8]:
        """Draw one step, (720, 1280, 3) uint8."""
        trace = self.trace
        self.picture.set_data(self.views[step])
        for ear, image in enumerate(self.sounds):
            image.set_data(self.pictures[step, ear])
        here = trace.path[step]
        self.source.set_data(*trace.goals[step][:, None])
        self.path.set_data(*trace.path[: step + 1].T)
        self.bumps.set_data(*trace.path[: step + 1][trace.collided[: step + 1]].T)
        self.agent.set_data(*here[:, None])
        # a triangle that points along the heading; its angle is counter-clockwise from north
        self.agent.set_marker((3, 0, -90.0 * (trace.state[step] % HEADINGS)))
        if trace.source_estimates is not None:
            self.estimate.set_data(*trace.source_estimates[step][:, None])
            self.ray.set_data(*np.stack((here, trace.source_estimates[step])).T)
        if trace.beliefs is not None:
            self._believe(trace.beliefs, min(step, len(trace.action) - 1))
        self.caption.set_text(self._words(step))
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _believe(self, beliefs: BeliefTrace, step: int) -> None:
        """Show the agent's beliefs at the time of its action."""
        if self.belief is not None and beliefs.free is not None:
            self.belief.set_data(beliefs.free[step])
        if self.posterior is not None:
            self.posterior.set_sizes(posterior_areas(beliefs, step))
        if self.recalled is not None and beliefs.retrieved is not None:
            self.recalled.set_data(*beliefs.retrieved[step, :, :2].T)

    def _words(self, step: int) -> str:
        count = len(self.trace.action)
        if step == count:
            return outcome(self.trace)
        collision = " (collision)" if self.trace.collided[step] else ""
        return f"action {step + 1} of {count}: {ACTIONS[self.trace.action[step]]}{collision}"

    def with_cursor(self, picture: NDArray[np.uint8], share: float) -> NDArray[np.uint8]:
        """Add a cursor to both spectrograms at a share of the second."""
        marked = picture.copy()
        for axes in self.ears:
            box = axes.get_window_extent()
            column = int(box.x0 + share * box.width)
            rows = slice(SIZE[1] - int(box.y1), SIZE[1] - int(box.y0))
            marked[rows, column : column + 2] = 255
        return marked
