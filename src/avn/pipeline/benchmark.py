"""Benchmark of the paper and description of a run's world, both from the run's config."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from omegaconf import DictConfig, OmegaConf

from avn.acoustics.sound_names import joined_names
from avn.core.settings import plain
from avn.modules.settings import SAME_WEIGHTS
from avn.pipeline.apartments import TEST, TRAINING
from avn.pipeline.dynamics import STEADY, changing
from avn.pipeline.published_networks import PUBLISHED
from avn.pipeline.run import Evaluation, agent_label
from avn.pipeline.sounds import sound_files
from avn.pipeline.stage import MACHINE
from avn.pipeline.trained import NETWORKS
from avn.reporting.paper import PAPER_SOUNDS
from avn.reporting.results import ALL_SOUNDS
from avn.reporting.world import sounds_text, trial_note

# World of the paper: the direct sound passes through walls, as in its sound engine.
PAPER_WORLD = {"split": "var", "protocol": "var", "acoustics": "resonance", **STEADY}
OF_THE_PACKAGE = "networks published with the package"
# Settings in which repetitions of a run differ, and those that change no record.
NOT_COMPARED = (
    *("seed", "train_seed", "film", "film_show", "film_speed", *MACHINE),
    *(f"trainer.{key}" for key in SAME_WEIGHTS),
)


def compared(key: str) -> bool:
    """Return whether runs that differ in a setting are compared by it."""
    return key not in NOT_COMPARED and key.split(".")[0] != "logger"


def changed_settings(cfg: DictConfig, default: DictConfig) -> dict[str, str]:
    """Return the settings that a run reads and that differ from its row and options.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    default : DictConfig
        Config of its row and options; see `avn.config.defaults.default_config`.

    Returns
    -------
    dict of str to str
        Value by dotted key, without seeds, sounds and settings of the machine.
    """
    # the sounds of training are compared as a whole, because one may be missing
    keys = {
        TRAINING.sounds if key.startswith(f"{TRAINING.sounds}.") else key
        for key in Evaluation(cfg).read()
        if not key.startswith(f"{TEST.sounds}.")
        and compared(key)
        and key != NETWORKS
        and not key.endswith(".train_seed")
    }
    keys -= {key for key in keys if _follows(cfg, key, keys)}
    values = {key: (plain(cfg, key), plain(default, key)) for key in sorted(keys)}
    return {key: _text(own) for key, (own, usual) in values.items() if own != usual}


def paper_sounds(cfg: DictConfig, default: DictConfig) -> frozenset[str]:
    """Return the sounds of a run beside whose results those of the paper may stand.

    The paper's results belong to its benchmark: the test apartments of `split=var`, `protocol=var`
    and `acoustics=resonance` with their default settings, an unchanged row of the table and the
    recordings of the package. Only seeds may differ.

    Parameters
    ----------
    cfg, default
        As for `changed_settings`.

    Returns
    -------
    frozenset of str
        Names of sounds; `all` is one of them if the run has the paper's three sounds and no other.
        Empty if the run is not of the benchmark.
    """
    named = {group: OmegaConf.select(cfg, f"{group}.name") for group in PAPER_WORLD}
    if named != PAPER_WORLD or agent_label(cfg) != cfg.agent.name:
        return frozenset()
    if cfg.agent.name != default.agent.name or changed_settings(cfg, default):
        return frozenset()
    files = sound_files(cfg)
    same = {name for name in PAPER_SOUNDS if files.get(name) == name}
    whole = set(files) == same == set(PAPER_SOUNDS)
    return frozenset(same | ({ALL_SOUNDS} if whole else set()))


def paper_sounds_by_agent(
    configs: Sequence[DictConfig], defaults: Sequence[DictConfig]
) -> Mapping[str, frozenset[str]]:
    """Return `paper_sounds` of several runs by the agent's name in tables.

    Runs of one agent are averaged in a table, so a sound counts if all of them have it.
    """
    sounds: dict[str, frozenset[str]] = {}
    for cfg, default in zip(configs, defaults, strict=True):
        own, name = paper_sounds(cfg, default), agent_label(cfg)
        sounds[name] = sounds.get(name, own) & own
    return sounds


def describe_world(cfg: DictConfig, default: DictConfig) -> str:
    """Describe a run's world in one line, the hardest part first.

    Acoustics, protocol, sounds and whether they were heard in training, microphone, apartments.

    Parameters
    ----------
    cfg, default
        As for `changed_settings`.
    """
    changed = changed_settings(cfg, default)
    training = OmegaConf.select(cfg, TRAINING.acoustics)
    reads_training = any(key.startswith(f"{TRAINING.acoustics}.") for key in Evaluation(cfg).read())
    acoustics = named(cfg, "acoustics", changed)
    own, other = ((node.name, node.head) for node in (training, cfg.acoustics))
    if reads_training and own != other:
        head = f" with head={training.head}" if training.head != cfg.acoustics.head else ""
        acoustics += f" (networks trained in {training.name}{head})"
    parts = [acoustics, named(cfg, "protocol", changed), sounds_text(*_sounds(cfg))]
    parts += [named(cfg, group, changed) for group in changing(cfg)]
    if microphone := _changes("microphone", changed):
        parts.append(f"microphone with {microphone}")
    split = named(cfg, "split", changed)
    scenes = OmegaConf.select(cfg, f"{TRAINING.split}.name")
    if reads_training and scenes != cfg.split.name:
        split += f" (networks trained in {scenes})"
    parts.append(f"{cfg.subset} apartments of {split}")
    if has_published_networks(cfg):
        parts.append(OF_THE_PACKAGE)
    return "; ".join(parts)


def has_published_networks(cfg: DictConfig) -> bool:
    """Return whether the networks of a run are those of the package."""
    return cfg.get(NETWORKS) == PUBLISHED and NETWORKS in Evaluation(cfg).read()


def note_of(cfg: DictConfig) -> str:
    """Return the warning about a run evaluated or trained in `split=mini`; empty for others."""
    return trial_note((cfg.split.name, OmegaConf.select(cfg, f"{TRAINING.split}.name")))


def caption_of(cfg: DictConfig, default: DictConfig) -> str:
    """Return the lines below the heading of a table: the world and, with `mini`, its warning."""
    return "\n".join(filter(None, (describe_world(cfg, default), note_of(cfg))))


def headings(cfg: DictConfig, default: DictConfig) -> dict[str, Any]:
    """Return what `avn.reporting.finished_run.show_run` prints beside the records of a run."""
    return {
        "caption": caption_of(cfg, default),
        "privileged": bool(cfg.agent.privileged),
        "paper": sorted(paper_sounds(cfg, default)),
    }


def _follows(cfg: DictConfig, key: str, keys: Collection[str]) -> bool:
    """Return whether a setting of the training world is that of the test world, which is read."""
    for own, other in ((TRAINING.split, TEST.split), (TRAINING.acoustics, TEST.acoustics)):
        test = key.replace(f"{own}.", f"{other}.", 1)
        if test != key and test in keys and plain(cfg, test) == plain(cfg, key):
            return True
    return False


def _text(value: object) -> str:
    """Return a setting's value as text; of sounds, their names."""
    return joined_names([*map(str, value)]) if isinstance(value, dict) else str(value)


def named(cfg: DictConfig, group: str, changed: Mapping[str, str]) -> str:
    """Return a group and its option, such as `protocol var with max_moves_ratio=3.0`.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    group : str
        Group of the config whose option has a name.
    changed : mapping of str to str
        Result of `changed_settings`.
    """
    name = OmegaConf.select(cfg, f"{group}.name")
    text = str(name) if group == "split" else f"{group} {name}"
    return f"{text} with {changes}" if (changes := _changes(group, changed)) else text


def _changes(group: str, changed: Mapping[str, str]) -> str:
    prefix = f"{group}."
    own = {k: v for k, v in changed.items() if k.startswith(prefix) and k != f"{prefix}name"}
    if target := own.pop(f"{prefix}_target_", None):
        own = {f"{prefix}class": target.rpartition(".")[2], **own}
    return ", ".join(f"{key.removeprefix(prefix)}={value}" for key, value in own.items())


def _sounds(cfg: DictConfig) -> tuple[list[str], list[str] | None]:
    """Return the names of a run's sounds, and those whose recordings its networks trained on."""
    files = sound_files(cfg)
    if not any(key.startswith(f"{TRAINING.sounds}.") for key in Evaluation(cfg).read()):
        return list(files), None
    recordings = set(sound_files(cfg, TRAINING).values())
    return list(files), [name for name, path in files.items() if path in recordings]
