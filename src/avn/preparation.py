"""What a set of runs needs, in the order in which it is made: the plan of a reproduction."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from omegaconf import DictConfig, OmegaConf

from avn import (
    evaluation,
    listening,
    pipeline,
    recognition,
    reinforcement,
    seeing,
    senses,
    sound_features,
)
from avn.stages import Stage, ask, digest

Make = Callable[[], object]


@dataclass(frozen=True)
class Step:
    """One stage of a plan.

    Attributes
    ----------
    stage : Stage
        What it is, how long it takes and whether it is missing.
    make : callable
        Makes it, with what it needs.
    run : DictConfig or None
        The config, where the stage is a run.
    """

    stage: Stage
    make: Make
    run: DictConfig | None = None


def steps(configs: Sequence[DictConfig]) -> list[Step]:
    """What some runs need, each stage once and before the first run that needs it, and the runs.

    The stages of runs that are there already are left out.

    Parameters
    ----------
    configs : sequence of DictConfig
        Configs of runs, in the order in which they shall walk.

    Raises
    ------
    UserError
        Where an option of one of them cannot work.
    """
    own = [(ask(partial(evaluation.evaluate, cfg)), cfg) for cfg in configs]
    # seeds of one row need the same
    first = {_without_seed(cfg): cfg for run, cfg in reversed(own) if run.missing}
    rows = {id(cfg): set(evaluation.wanted_by(cfg)) - _shown(cfg) for cfg in first.values()}
    featured = {
        listening.hear_hash(cfg): cfg
        for cfg in first.values()
        if "sound_feature" in rows[id(cfg)] and listening.hears(cfg)
    }
    found: dict[tuple[str, str], Step] = {}
    for run, cfg in own:
        for make in _needed(cfg, rows[id(cfg)], featured) if id(cfg) in rows else ():
            stage = ask(make)
            found.setdefault((str(stage.folder), stage.what), Step(stage, make))
        walk = partial(evaluation.evaluate, cfg)
        found.setdefault((str(run.folder), run.what), Step(run, walk, cfg))
    return [*found.values()]


def _without_seed(cfg: DictConfig) -> str:
    plain = OmegaConf.to_container(cfg, resolve=True)
    assert isinstance(plain, dict)
    return digest({key: value for key, value in plain.items() if key != "seed"})


def _needed(cfg: DictConfig, wanted: set[str], featured: dict[str, DictConfig]) -> Iterator[Make]:
    """What makes the stages of a row.

    `featured` are configs for which features of clips are made, by what listens to which clips.
    """
    learns = reinforcement.learns(cfg)
    parts = (*reinforcement.PARTS, cfg.part) if learns else (cfg.part,)
    rooms = pipeline.scenes(cfg, parts)
    if wanted & set(senses.SIGHTS):
        yield from _seen(cfg, wanted, parts)
    if listening.hears(cfg) and wanted & {"sound", "sound_feature"}:
        yield partial(pipeline.scenes, cfg, _all_parts(cfg), audible=True)
        yield partial(listening.sound_model, cfg)
    if listening.can_stop(cfg) and "reach" in wanted:
        yield partial(pipeline.scenes, cfg, _all_parts(cfg), audible=True)
        yield partial(listening.stop_model, cfg)
        yield partial(listening.stop_scores, cfg, rooms[cfg.part])
    if listening.hears(cfg) and wanted & {"sound", "sound_feature"}:
        yield from _heard(cfg, wanted, featured)
    if learns:
        yield partial(reinforcement.policy, cfg)


def _shown(cfg: DictConfig) -> set[str]:
    """Observations that an agent is shown the truth of."""
    return {{"location": "sound"}.get(truth, truth) for truth in cfg.agent.truth}


def _all_parts(cfg: DictConfig) -> list[str]:
    return [part for part, found in pipeline.plans(cfg).items() if found]


def _seen(cfg: DictConfig, wanted: set[str], parts: Sequence[str]) -> Iterator[Make]:
    yield partial(pipeline.seen_scenes, cfg, _all_parts(cfg))
    if "feature" in wanted:
        yield partial(recognition.features, cfg, parts)
    if "window" in wanted and seeing.sees_windows(cfg):
        yield partial(seeing.occupancy_model, cfg)
        for part in parts:
            yield partial(seeing.windows, cfg, pipeline.scenes(cfg, (part,))[part])


def _heard(cfg: DictConfig, wanted: set[str], featured: dict[str, DictConfig]) -> Iterator[Make]:
    if reinforcement.learns(cfg):
        for part in reinforcement.PARTS:
            yield _features(cfg, part, reinforcement.clips_of(cfg, part))
    # estimates come with the features, so that every clip is listened to once
    other = featured.get(listening.hear_hash(cfg))
    if other is not None:
        yield _features(other, cfg.part, sound_features.evaluated_clips(other))
    if "sound" in wanted:
        yield partial(listening.hearing, cfg, pipeline.scenes(cfg, (cfg.part,))[cfg.part])


def _features(cfg: DictConfig, part: str, clips: sound_features.Clips) -> Make:
    rooms = pipeline.scenes(cfg, (part,))[part]
    return partial(sound_features.sound_features, cfg, rooms, clips)
