"""Names of finished runs: the agent and the settings that tell it apart from other runs."""

from __future__ import annotations

from collections.abc import Sequence

from avn.acoustics.sound_names import joined_names
from avn.core.settings import plain
from avn.pipeline.benchmark import PAPER_WORLD, changed_settings, compared
from avn.pipeline.dynamics import GROUPS
from avn.pipeline.replay import Run

# Settings of the world and of how an agent observes. Others are named only if needed.
_TELLING = (
    *("acoustics", "protocol", "sound", "microphone", *GROUPS, "split", "subset", "episodes"),
    *("look", "localisation", "exploration", "seed", "train_seed"),
)
# Settings that a saved config holds resolved, in the parts that read them.
_RESOLVED = ("look", "localisation", "train_seed")
# Further settings of a name are counted.
_MOST = 4


def names_of(runs: Sequence[Run]) -> list[str]:
    """Return distinct names of runs: the agent and the settings in which they differ.

    A setting is named where the run reads it, where it differs from the run's row and where runs
    that read it differ in it. Seeds and sounds have no default and are named where they differ.
    """
    parts = [_parts(run, runs) for run in runs]
    telling = [{key: own[key] for key in _TELLING if key in own} for own in parts]
    names = [_name(run, own) for run, own in zip(runs, telling, strict=True)]
    if len(set(names)) < len(names):
        names = [
            _name(run, first | own) for run, first, own in zip(runs, telling, parts, strict=True)
        ]
    if len(set(names)) < len(names):
        names = [f"{name} ({run.folder.name})" for name, run in zip(names, runs, strict=True)]
    return names


def settings_but_seed(run: Run) -> str:
    """Return all settings of a run that change its records, without the seed of its episodes."""
    kept = {
        key: value for key, value in run.settings.items() if key == "train_seed" or compared(key)
    }
    return repr([(key, value) for key, value in kept.items() if key != "seed"])


def _name(run: Run, parts: dict[str, str]) -> str:
    texts = [f"{key}={value}" for key, value in parts.items()]
    if len(texts) > _MOST:
        texts = [*texts[:_MOST], f"{len(texts) - _MOST} more settings"]
    return ", ".join((str(run.cfg.agent.name), *texts))


def _parts(run: Run, runs: Sequence[Run]) -> dict[str, str]:
    """Return the settings of a run that may be named, by label."""
    sounds = [key for key in run.settings if key.startswith("sound.")]
    seeds = [key for key in run.settings if key.rsplit(".", 1)[-1] in ("seed", "train_seed")]
    options = [f"{group}.name" for group in PAPER_WORLD]
    changed = [key for key in options if plain(run.cfg, key) != PAPER_WORLD[key.split(".")[0]]]
    changed += changed_settings(run.cfg, run.default)
    parts = {
        _label(key): str(plain(run.cfg, key)) for key in (*changed, *seeds) if _tells(key, runs)
    }
    if sounds and len({tuple(other.cfg.sound) for other in runs}) > 1:
        parts["sound"] = joined_names([*map(str, run.cfg.sound)])
    return parts


def _label(key: str) -> str:
    last = key.rsplit(".", 1)[-1]
    return last if last in _RESOLVED else key.removesuffix(".name")


def _tells(key: str, runs: Sequence[Run]) -> bool:
    """Return whether the runs differ in an option of the world, or those that read a setting."""
    if key.removesuffix(".name") in PAPER_WORLD:
        return len({plain(run.cfg, key) for run in runs}) > 1
    return len({run.settings[key] for run in runs if key in run.settings}) > 1
