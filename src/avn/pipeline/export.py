"""The apartments of a split, made whole, drawn, and exported for listening."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from omegaconf import DictConfig

from avn.acoustics.clips import ClipRenderer, DrySounds, brir_spectra, export_wav
from avn.acoustics.dry_sounds import load_sounds
from avn.core.errors import UserError
from avn.core.progress import tell
from avn.dataset.scene import Scene
from avn.pipeline import audio_inference, scenes
from avn.reporting.contact_sheet import save_contact_sheet
from avn.reporting.floor_plan_figure import save_floor_plan

EXPORTS = ("wav",)


def generate(cfg: DictConfig) -> Path:
    """Make all scenes of the split, draw plans and contact sheets, and export what is asked for.

    Parameters
    ----------
    cfg : DictConfig
        Of `avn.generate`.

    Returns
    -------
    Path
        The folder of the scene folders.

    Raises
    ------
    UserError
        Where an option cannot work.
    """
    if cfg.export is not None and cfg.export not in EXPORTS:
        raise UserError(f"export: '{cfg.export}' is none of {', '.join(EXPORTS)}")
    if cfg.export is None and (cfg.clips or cfg.apartments):
        raise UserError("clips, apartments: choose what export=wav writes; add export=wav")
    parts = [part for part, found in scenes.plans(cfg).items() if found]
    opened = scenes.scenes(cfg, parts, audible=True, asked=True)
    scenes.seen_scenes(cfg, parts, asked=True)
    hashes = scenes.views_hashes(cfg, parts)
    every = [which for part in parts for which in opened[part]]
    made = [own for part in parts for own in hashes[part]]
    for which, made_from in zip(every, made, strict=True):
        save_floor_plan(which.plan, which.folder / "floor_plan.png", which.grid)
        sheet = which.folder / f"contact_sheet-{cfg.renderer.name}.png"
        views = which.views(cfg.renderer.name, made_from)
        save_contact_sheet(which.plan, which.grid, views.rgb, sheet)
        _report(cfg, which)
    if cfg.export == "wav":
        _export(cfg, _chosen(cfg, every))
    return scenes.scenes_folder(cfg)


def _report(cfg: DictConfig, which: Scene) -> None:
    brirs = which.brirs(cfg.acoustics.name)  # reading it also shows that the files are whole
    share = np.mean(10 ** (brirs.cut_db / 10))
    mean = 10 * np.log10(share) if share > 0 else -np.inf
    size = sum(path.stat().st_size for path in which.folder.glob("*.h5")) / 1e6
    tell(
        f"{which.name}: {which.grid.cells} cells, {len(which.plan.rooms)} rooms, "
        f"{len(which.sources)} sources, {size:.0f} MB; energy after {cfg.acoustics.seconds} s: "
        f"{mean:.0f} dB of the reverberation on average, {brirs.cut_db.max():.0f} dB at most"
    )


def _chosen(cfg: DictConfig, every: list[Scene]) -> list[Scene]:
    names = [which.name for which in every]
    for name in cfg.apartments:
        if name not in names:
            raise UserError(f"apartments: '{name}' is none of {', '.join(names)}")
    return [which for which in every if not cfg.apartments or which.name in cfg.apartments]


def _export(cfg: DictConfig, chosen: list[Scene]) -> None:
    sounds = DrySounds(load_sounds(audio_inference.sound_files(cfg)))
    render = ClipRenderer(sounds, scenes.typed(cfg.microphone), seed=0, purpose="eval")
    for which in chosen:
        pairs = [tuple(pair) for pair in cfg.clips] or _near_and_far(which)
        _check_pairs(which, pairs)
        source, state = (torch.tensor(column) for column in zip(*pairs, strict=True))
        spectra = brir_spectra(which.brirs(cfg.acoustics.name).gather(source, state))
        for index, name in enumerate(sounds.names):
            sound = torch.full_like(source, index)
            clips = render.render(spectra, source, state, sound, torch.zeros_like(source))
            for (k, s), clip in zip(pairs, clips, strict=True):
                file = f"{name}-{cfg.acoustics.name}-source{k}-state{s}.wav"
                export_wav(which.folder / "wav" / file, clip)
        tell(f"{which.name}: {len(pairs) * len(sounds)} clips in {which.folder / 'wav'}")


def _near_and_far(which: Scene) -> list[tuple[int, int]]:
    """States facing north at a quarter, half and all of the way from the first source."""
    moves = which.grid.distances[which.sources[0]]
    order = moves.argsort(kind="stable")
    return [(0, 4 * int(order[int(share * (len(order) - 1))])) for share in (0.25, 0.5, 1.0)]


def _check_pairs(which: Scene, pairs: list[tuple[int, int]]) -> None:
    sources, states = len(which.sources), 4 * which.grid.cells
    for pair in pairs:
        if len(pair) != 2 or not (0 <= pair[0] < sources and 0 <= pair[1] < states):
            raise UserError(
                f"clips: {list(pair)} is no [source, state] of {which.name}, which has sources 0 "
                f"to {sources - 1} and states 0 to {states - 1}"
            )
