"""Sides of a comparison: finished runs of one setting over seeds and networks.

Only the files of the runs are read; this module does not import torch.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from avn.core.errors import UserError
from avn.pipeline.run_list import read_config, run_folders
from avn.pipeline.stage import MACHINE
from avn.reporting.comparison import Comparison, compare
from avn.reporting.finished_run import EPISODE_RECORDS, RESULTS, read_episodes
from avn.reporting.nesting import NETWORK

_RECORDINGS = "recordings.csv"
# Prefix of the hash of a sound's recording among the settings.
_HASH = "recording.of."
# Settings in which the runs of a side may differ, and those that change no record.
_REPEATED = ("seed", NETWORK)
_NO_RECORD = (*MACHINE, "film", "film_show", "film_speed")
# Settings of the episodes: both sides of a comparison have the same.
_EPISODES = (
    *("split.name", "split.folder", "split.seed", "split.size", "split.test", "split.sources"),
    *("subset", "episodes", "protocol", "sound", "recording"),
)
# Differing settings of two sides that are named; further ones are counted.
_MOST = 4


@dataclass(frozen=True)
class Side:
    """Runs of one agent and setting.

    Attributes
    ----------
    name : str
        Agent, as its records name it.
    given : str
        The runs, as they were given.
    seeds, networks : tuple of int
        Values of `seed` and `train_seed`.
    settings : dict of str to str
        Values by dotted key, without the seeds, and the hashes of the recordings.
    episodes : DataFrame
        Records of all runs, with the column `train_seed`.
    """

    name: str
    given: str
    seeds: tuple[int, ...]
    networks: tuple[int, ...]
    settings: dict[str, str]
    episodes: pd.DataFrame


def open_side(text: str, outputs: Path) -> Side:
    """Read the runs of a side.

    Parameters
    ----------
    text : str
        Runs with commas between them; each as `find_run` takes it.
    outputs : Path
        Folder of the outputs in which names are looked up.

    Raises
    ------
    UserError
        Where a run is not found, unfinished or damaged, or the runs are not of one setting.
    """
    parts = [text] if Path(text).is_dir() else text.split(",")
    folders = [find_run(part, outputs) for part in parts]
    configs = [_config(folder) for folder in folders]
    settings = [_settings(cfg, folder) for cfg, folder in zip(configs, folders, strict=True)]
    for own, folder in zip(settings[1:], folders[1:], strict=True):
        if differing := _differing(settings[0], own):
            raise UserError(
                f"{folder}: not a repetition of {folders[0]}, it has another "
                f"{_words(differing)}; a comma joins runs that differ in seed or train_seed only"
            )
    repeated = [tuple(int(cfg[key]) for key in _REPEATED) for cfg in configs]
    _check_grid(repeated, folders)
    records = [
        read_episodes(folder).assign(**{NETWORK: network})
        for folder, (_, network) in zip(folders, repeated, strict=True)
    ]
    episodes = pd.concat(records, ignore_index=True)
    seeds, networks = (tuple(sorted(set(values))) for values in zip(*repeated, strict=True))
    return Side(str(episodes["agent"].iloc[0]), text, seeds, networks, settings[0], episodes)


def find_run(text: str, outputs: Path) -> Path:
    """Return the folder of a run.

    Parameters
    ----------
    text : str
        Its folder; or of a run below `outputs`, the hash of its folder, the folder's name, or agent
        and hash, such as `a2b05ce3`, `seed0-a2b05ce3` or `greedy-a2b05ce3`.
    outputs : Path
        Folder of the outputs.

    Raises
    ------
    UserError
        Where there is no such run, or several.
    """
    if not text:
        raise UserError("RUN: empty; give a run's folder or a name that avn ls lists")
    if Path(text).is_dir():
        return Path(text)
    if not outputs.is_dir():
        raise UserError(
            f"{text}: no folder, and there is no {outputs}; name it by --outputs FOLDER"
        )
    found = [folder for folder in run_folders(outputs) if text in _names(folder)]
    if not found:
        raise UserError(f"{text}: neither a folder nor a run of {outputs}; avn ls lists its runs")
    if len(found) > 1:
        raise UserError(f"{text}: {len(found)} runs of {outputs} have this name; give a folder")
    return found[0]


def differences(one: Side, other: Side) -> list[str]:
    """Return the settings in which two sides differ, as texts.

    Where a group has another option, its other settings are left out.
    """
    keys = _differing(one.settings, other.settings)
    groups = {key.rpartition(".")[0] for key in keys if key.endswith((".name", "._target_"))}
    named = [key for key in keys if key.endswith(".name") or not _is_below(key, groups)]
    named = [key for key in named if key != "agent.name"] if one.name != other.name else named
    texts = [
        f"{key.removesuffix('.name')} {one.settings[key]} / {other.settings[key]}" for key in named
    ]
    more = [f"{len(texts) - _MOST} more settings"] if len(texts) > _MOST else []
    return texts[:_MOST] + more


def compare_sides(one: Side, other: Side) -> Comparison:
    """Compare two sides over the same episodes.

    Raises
    ------
    UserError
        Where they cannot be paired; the message names what differs, and in which runs.
    """
    for key in _differing(one.settings, other.settings):
        if _is_below(key, _EPISODES) or key in _EPISODES:
            values = [f"{side.settings[key]} in {side.given}" for side in (one, other)]
            raise UserError(
                f"{key}: {' and '.join(values)}; only runs of the same episodes are compared"
            )
    return compare(one.episodes, other.episodes, (one.given, other.given))


def _names(folder: Path) -> set[str]:
    code = folder.name.rpartition("-")[2]
    return {folder.name, code, f"{folder.parents[1].name}-{code}"}


def _config(folder: Path) -> dict[str, Any]:
    for name in (RESULTS, EPISODE_RECORDS):
        if not (folder / name).is_file():
            raise UserError(f"{folder}: no finished run, it has no {name}; run avn.eval again")
    cfg = read_config(folder)
    if not all(isinstance(cfg.get(key), int) for key in _REPEATED):
        raise UserError(f"{folder}: its config.yaml is missing or damaged; run avn.eval again")
    return cfg


def _settings(cfg: Mapping[str, Any], folder: Path) -> dict[str, str]:
    """Return the settings of a run that tell it from runs that are no repetitions of it."""
    left = {key: value for key, value in cfg.items() if key not in (*_REPEATED, *_NO_RECORD)}
    found = {key: value for key, value in _leaves(left) if key.rpartition(".")[2] != NETWORK}
    if not (folder / _RECORDINGS).is_file():
        return found
    try:
        kept = pd.read_csv(folder / _RECORDINGS, dtype=str, keep_default_na=False)
        hashes = dict(zip(kept["sound"], kept["sha256"], strict=True))
    except (OSError, ValueError, KeyError) as error:
        raise UserError(f"{folder}: {_RECORDINGS} is damaged; run avn.eval again") from error
    return found | {f"{_HASH}{name}": value[:8] for name, value in hashes.items()}


def _leaves(node: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in node.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", str(value)


def _differing(one: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """Return the keys with different values, of those that both have.

    A config of an earlier version has fewer keys. A recording is compared by its hash where both
    have it, otherwise by its path.
    """
    hashed = {key.replace(_HASH, "sound.") for key in one if key in other and _HASH in key}
    return [key for key in one if key in other and key not in hashed and one[key] != other[key]]


def _is_below(key: str, nodes: Sequence[str] | set[str]) -> bool:
    return any(key.startswith(f"{node}.") for node in nodes)


def _words(keys: Sequence[str]) -> str:
    more = f" and {len(keys) - _MOST} more settings" if len(keys) > _MOST else ""
    return ", ".join(keys[:_MOST]) + more


def _check_grid(repeated: Sequence[tuple[int, ...]], folders: Sequence[Path]) -> None:
    """Refuse runs that are no complete grid of seeds and networks."""
    seen: dict[tuple[int, ...], Path] = {}
    for pair, folder in zip(repeated, folders, strict=True):
        if pair in seen:
            raise UserError(
                f"{folder}: has the seed and train_seed of {seen[pair]}; give each run once"
            )
        seen[pair] = folder
    seeds, networks = (sorted(set(values)) for values in zip(*repeated, strict=True))
    for seed in seeds:
        for network in networks:
            if (seed, network) not in seen:
                raise UserError(
                    f"{folders[0]}: of its side, the run with seed={seed} train_seed={network} is "
                    "not given; give every network with every seed"
                )
