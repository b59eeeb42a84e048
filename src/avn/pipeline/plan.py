"""What a set of runs needs, in the order in which it is made: the plan of a reproduction."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

from omegaconf import DictConfig, OmegaConf

from avn.core.hashing import digest
from avn.dataset.scene import Scene
from avn.pipeline import (
    audio_features,
    observations,
    occupancy,
    policy,
    scenes,
    sound_network,
    stop_classifier,
    visual_features,
)
from avn.pipeline.audio_features import Clips
from avn.pipeline.run import evaluate, wanted_by
from avn.pipeline.stage import Stage, ask

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

    Left out are the stages of what is there already.

    Parameters
    ----------
    configs : sequence of DictConfig
        Configs of runs, in the order in which they shall walk.

    Raises
    ------
    UserError
        Where an option of one of them cannot work.
    """
    own = [(ask(partial(evaluate, cfg)), cfg) for cfg in configs]
    # seeds of one row need the same
    first = {_without_seed(cfg): cfg for run, cfg in reversed(own) if run.missing}
    rows = {id(cfg): set(wanted_by(cfg)) - _shown(cfg) for cfg in first.values()}
    featured = {
        sound_network.hear_hash(cfg): cfg
        for cfg in first.values()
        if "sound_feature" in rows[id(cfg)] and sound_network.hears(cfg)
    }
    found: dict[Hashable, Step] = {}
    for run, cfg in own:
        for make in _needed(cfg, rows[id(cfg)], featured) if id(cfg) in rows else ():
            stage = ask(make)
            found.setdefault((stage.folder, stage.what), Step(stage, make))
        walk = partial(evaluate, cfg)
        found.setdefault(run.folder, Step(run, walk, cfg))
    return [*found.values()]


def _without_seed(cfg: DictConfig) -> str:
    plain = OmegaConf.to_container(cfg, resolve=True)
    assert isinstance(plain, dict)
    return digest({key: value for key, value in plain.items() if key != "seed"})


def _shown(cfg: DictConfig) -> set[str]:
    """Observations that an agent is shown the truth of."""
    return {{"location": "sound"}.get(truth, truth) for truth in cfg.agent.truth}


def _needed(cfg: DictConfig, wanted: set[str], featured: dict[str, DictConfig]) -> Iterator[Make]:
    """What makes the stages of a row.

    `featured` are configs for which features of clips are made, by what listens to which clips.
    """
    if policy.learns(cfg):
        learnt = (_observed(cfg, wanted, part, policy.clips_of(cfg, part)) for part in policy.PARTS)
        yield from _before(partial(policy.policy, cfg), chain.from_iterable(learnt))
    if wanted & set(observations.SOUNDS) and (
        sound_network.hears(cfg) or stop_classifier.can_stop(cfg)
    ):
        yield from _audible(cfg, (cfg.part,))
    if "sound" in wanted and sound_network.hears(cfg):
        yield from _estimates(cfg, featured)
    if "reach" in wanted and stop_classifier.can_stop(cfg):
        scores = partial(stop_classifier.stop_scores, cfg, _rooms(cfg, cfg.part))
        # the network is opened for its threshold too
        yield from _before(
            partial(stop_classifier.stop_model, cfg), _audible(cfg, occupancy.TRAINED_ON)
        )
        yield from _before(scores, ())
    yield from _observed(cfg, wanted, cfg.part, audio_features.evaluated_clips(cfg))


def _before(product: Make, needs: Iterable[Make]) -> Iterator[Make]:
    """What makes a product, where it is missing, after what it needs."""
    if ask(product).missing:
        yield from needs
        yield product


def _rooms(cfg: DictConfig, part: str) -> list[Scene]:
    return scenes.scenes(cfg, (part,))[part]


def _audible(cfg: DictConfig, parts: Sequence[str]) -> list[Make]:
    # part by part, so that what two stages need is one stage
    return [partial(scenes.scenes, cfg, (part,), audible=True) for part in parts]


def _views(cfg: DictConfig, parts: Sequence[str]) -> list[Make]:
    return [partial(scenes.seen_scenes, cfg, (part,)) for part in parts]


def _observed(cfg: DictConfig, wanted: set[str], part: str, clips: Clips) -> Iterator[Make]:
    """What an agent sees in the apartments of a part, and features of what it hears there."""
    views = _views(cfg, (part,))
    if wanted & {"view", "depth"}:
        yield from views
    if "feature" in wanted:
        yield from _before(partial(visual_features.features, cfg, (part,)), views)
    if "window" in wanted and occupancy.sees_windows(cfg):
        windows = partial(occupancy.windows, cfg, _rooms(cfg, part))
        yield from _before(windows, chain(views, _occupancy_network(cfg)))
    if "sound_feature" in wanted and sound_network.hears(cfg):
        yield from _features(cfg, part, clips)


def _occupancy_network(cfg: DictConfig) -> Iterator[Make]:
    needs = _views(cfg, occupancy.TRAINED_ON)
    if cfg.occupancy_model.looks > 1:
        needs.append(partial(occupancy.make_looks, cfg))
    yield from _before(partial(occupancy.occupancy_model, cfg), needs)


def _sound_network(cfg: DictConfig) -> Iterator[Make]:
    yield from _before(partial(sound_network.sound_model, cfg), _audible(cfg, occupancy.TRAINED_ON))


def _features(cfg: DictConfig, part: str, clips: Clips) -> Iterator[Make]:
    make = partial(audio_features.sound_features, cfg, _rooms(cfg, part), clips)
    yield from _before(make, chain(_sound_network(cfg), _audible(cfg, (part,))))


def _estimates(cfg: DictConfig, featured: dict[str, DictConfig]) -> Iterator[Make]:
    """What the sound network says of every clip.

    Where another row needs features of the same clips, they are made first, since the estimates of
    a network that is symmetric come with them.
    """
    estimates = partial(sound_network.hearing, cfg, _rooms(cfg, cfg.part))
    other = featured.get(sound_network.hear_hash(cfg))
    if other is not None and cfg.sound_model.symmetric:
        if ask(estimates).missing:
            yield from _features(other, cfg.part, audio_features.evaluated_clips(other))
        return
    yield from _before(estimates, _sound_network(cfg))
