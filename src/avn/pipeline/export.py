"""The apartments of a split, made whole, drawn, and exported for listening."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from omegaconf import DictConfig

from avn.acoustics.clips import ClipRenderer, brir_spectra, export_wav
from avn.core.classes import build_object
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.progress import log
from avn.core.settings import leaves
from avn.dataset.scene import AudibleScene, Scene
from avn.dataset.views import Views
from avn.pipeline.apartments import apartments_of_every_part
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sounds import dry_sounds
from avn.pipeline.stage import Stage, make, missing
from avn.pipeline.views import RenderedViews
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
        The folder that the folders of the apartments lie in.

    Raises
    ------
    UserError
        Where an option cannot work.
    """
    if cfg.export is not None and cfg.export not in EXPORTS:
        raise UserError(f"export: '{cfg.export}' is none of {', '.join(EXPORTS)}")
    if cfg.export is None and (cfg.clips or cfg.apartments):
        raise UserError("clips, apartments: choose what export=wav writes; add export=wav")
    for stage in missing(stages_of(cfg)):
        make(stage, explicit=True)
    every: list[AudibleScene] = []
    for apartments in apartments_of_every_part(cfg):
        sound, rendered = DirectSound(cfg, apartments), RenderedViews(cfg, apartments)
        for scene, views in zip(sound.load(), rendered.load(), strict=True):
            _draw(cfg, scene, views)
            _report(cfg, scene)
            every.append(scene)
    if cfg.export == "wav":
        _export(cfg, _chosen(cfg, every))
    return Path(cfg.outputs) / "generate"


def stages_of(cfg: DictConfig) -> list[Stage]:
    """The sound and the views of every part of the split."""
    every = apartments_of_every_part(cfg)
    return [kind(cfg, own) for kind in (DirectSound, RenderedViews) for own in every]


def settings_of(cfg: DictConfig) -> set[str]:
    """Leaf keys of the config that are read."""
    own = ["apartments", "export", "clips"]
    heard = ["sound", "microphone"] if cfg.export == "wav" else []
    return leaves(cfg, [*own, *heard]).union(*(stage.read() for stage in stages_of(cfg)))


def _draw(cfg: DictConfig, scene: AudibleScene, views: Views) -> None:
    save_floor_plan(scene.plan, scene.folder / "floor_plan.png", scene.grid)
    sheet = scene.folder / f"contact_sheet-{cfg.renderer.name}.png"
    save_contact_sheet(scene.plan, scene.grid, views.rgb, sheet)


def _report(cfg: DictConfig, scene: AudibleScene) -> None:
    share = np.mean(10 ** (scene.brirs.cut_db / 10))
    mean = 10 * np.log10(share) if share > 0 else -np.inf
    size = sum(path.stat().st_size for path in scene.folder.glob("*.h5")) / 1e6
    log(
        f"{scene.folder}: {scene.grid.cells} cells, {len(scene.plan.rooms)} rooms, "
        f"{len(scene.sources)} sources, {size:.0f} MB; energy after {cfg.acoustics.seconds} s: "
        f"{mean:.0f} dB of the reverberation on average, {scene.brirs.cut_db.max():.0f} dB at most"
    )


def _chosen(cfg: DictConfig, every: list[AudibleScene]) -> list[AudibleScene]:
    names = [which.name for which in every]
    for name in cfg.apartments:
        if name not in names:
            raise UserError(f"apartments: '{name}' is none of {', '.join(names)}")
    return [which for which in every if not cfg.apartments or which.name in cfg.apartments]


def _export(cfg: DictConfig, chosen: list[AudibleScene]) -> None:
    sounds = dry_sounds(cfg)
    render = ClipRenderer(
        sounds, build_object("microphone", cfg.microphone), seed=0, purpose="eval"
    )
    for which in chosen:
        pairs = [tuple(pair) for pair in cfg.clips] or _near_and_far(which)
        _check_pairs(which, pairs)
        source, state = (torch.tensor(column) for column in zip(*pairs, strict=True))
        spectra = brir_spectra(which.brirs.gather(source, state), sounds.rate)
        for index, name in enumerate(sounds.names):
            sound = torch.full_like(source, index)
            clips = render.render(spectra, ClipId(source, state, sound, torch.zeros_like(source)))
            for (k, s), clip in zip(pairs, clips, strict=True):
                file = f"{name}-{cfg.acoustics.name}-source{k}-state{s}.wav"
                export_wav(which.folder / "wav" / file, clip, sounds.rate)
        log(f"{which.name}: {len(pairs) * len(sounds)} clips in {which.folder / 'wav'}")


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
