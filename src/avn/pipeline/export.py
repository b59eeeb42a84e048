"""Generation of a split's apartments, with drawings and exported clips."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from omegaconf import DictConfig

from avn.acoustics.clips import ClipRenderer, brir_spectra, export_wav
from avn.apartments.floor_plan import FloorPlan
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.progress import log
from avn.core.settings import leaves
from avn.dataset.scene import AudibleScene, Scene
from avn.dataset.views import Views
from avn.pipeline.apartments import apartments_of_all_subsets, cells_of
from avn.pipeline.building import discard_if_forced, make, missing
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sounds import check_heard, dry_sounds, microphone_of
from avn.pipeline.stage import Stage, with_needs
from avn.pipeline.views import RenderedViews
from avn.reporting.contact_sheet import save_contact_sheet
from avn.reporting.floor_plan_figure import save_floor_plan

EXPORTS = ("wav",)


def generate(cfg: DictConfig) -> Path:
    """Build all scenes of the split, draw plans and contact sheets, and write the exports.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.generate`.

    Returns
    -------
    Path
        Parent of the apartments' folders.

    Raises
    ------
    UserError
        Where an option cannot work.
    """
    _check(cfg)
    stages = stages_of(cfg)
    discard_if_forced(with_needs(stages))
    for stage in missing(stages):
        make(stage, explicit=True)
    scenes: list[AudibleScene] = []
    for apartments in apartments_of_all_subsets(cfg):
        sound, rendered = DirectSound(cfg, apartments), RenderedViews(cfg, apartments)
        for scene, views in zip(sound.load(), rendered.load(), strict=True):
            _draw(cfg, scene, views)
            _report(cfg, scene)
            scenes.append(scene)
    if cfg.export == "wav":
        chosen = cfg.apartments
        _export(cfg, [scene for scene in scenes if not chosen or scene.name in chosen])
    return Path(cfg.outputs) / "generate"


def _check(cfg: DictConfig) -> None:
    """Refuse an export that cannot work, before anything is made."""
    if cfg.export is not None and cfg.export not in EXPORTS:
        raise UserError(f"export: '{cfg.export}' is none of {', '.join(EXPORTS)}")
    if cfg.export is None and (cfg.clips or cfg.apartments):
        raise UserError("clips, apartments: choose what export=wav writes; add export=wav")
    if cfg.export is None:
        return
    check_heard(cfg)
    subsets = apartments_of_all_subsets(cfg)
    plans = {plan.name: plan for apartments in subsets for plan in apartments.plans}
    for name in cfg.apartments:
        if name not in plans:
            raise UserError(f"apartments: '{name}' is none of {', '.join(plans)}")
    for name in cfg.apartments or plans:
        _check_pairs(plans[name], cfg.clips)


def stages_of(cfg: DictConfig) -> list[Stage]:
    """Return the stages of acoustics and views of all subsets of the split."""
    subsets = apartments_of_all_subsets(cfg)
    return [kind(cfg, subset) for kind in (DirectSound, RenderedViews) for subset in subsets]


def settings_of(cfg: DictConfig) -> set[str]:
    """Return the leaf keys of the config that are read."""
    keys = ["apartments", "export", "clips"]
    heard = ["sound", "microphone"] if cfg.export == "wav" else []
    return leaves(cfg, [*keys, *heard]).union(*(stage.read() for stage in stages_of(cfg)))


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


def _export(cfg: DictConfig, scenes: list[AudibleScene]) -> None:
    sounds = dry_sounds(cfg)
    render = ClipRenderer(sounds, microphone_of(cfg), seed=0, purpose="eval")
    for scene in scenes:
        pairs = [tuple(pair) for pair in cfg.clips] or _near_and_far(scene)
        source, state = (torch.tensor(column) for column in zip(*pairs, strict=True))
        spectra = brir_spectra(scene.brirs.gather(source, state), sounds.rate)
        for index, name in enumerate(sounds.names):
            sound = torch.full_like(source, index)
            clips = render.render(spectra, ClipId(source, state, sound, torch.zeros_like(source)))
            for (k, s), clip in zip(pairs, clips, strict=True):
                file = f"{name}-{cfg.acoustics.name}-source{k}-state{s}.wav"
                export_wav(scene.folder / "wav" / file, clip, sounds.rate)
        log(f"{scene.name}: {len(pairs) * len(sounds)} clips in {scene.folder / 'wav'}")


def _near_and_far(scene: Scene) -> list[tuple[int, int]]:
    """Return states facing north at 25, 50 and 100 % of the cells by distance to the source."""
    moves = scene.grid.distances[scene.sources[0]]
    order = moves.argsort(kind="stable")
    return [(0, 4 * int(order[int(share * (len(order) - 1))])) for share in (0.25, 0.5, 1.0)]


def _check_pairs(plan: FloorPlan, pairs: Sequence[Sequence[int]]) -> None:
    sources, states = len(plan.sources), 4 * cells_of(plan)
    for pair in pairs:
        if len(pair) != 2 or not (0 <= pair[0] < sources and 0 <= pair[1] < states):
            raise UserError(
                f"clips: {list(pair)} is no [source, state] of {plan.name}, which has sources 0 "
                f"to {sources - 1} and states 0 to {states - 1}"
            )
