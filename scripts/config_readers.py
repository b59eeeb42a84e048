"""Stages of the pipeline that read each config key, found by composing runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import zip_longest

from hydra import compose
from omegaconf import DictConfig, OmegaConf

from avn.config.folder import conf_folder
from avn.core.errors import UserError
from avn.pipeline import export
from avn.pipeline.models import MODELS
from avn.pipeline.observation_table import OBSERVATIONS
from avn.pipeline.run import Evaluation
from avn.pipeline.stage import Stage


@dataclass
class Readers:
    """Names of the stages that read each leaf key.

    Attributes
    ----------
    by_leaf : dict of str to set of str
        Names of stages, by dotted key.
    stages : set of str
        Names of all stages.
    nodes : dict of tuple to set of str
        First parts of the keys that each run reads.
    """

    by_leaf: dict[str, set[str]] = field(default_factory=dict)
    stages: set[str] = field(default_factory=set)
    nodes: dict[tuple[str, ...], set[str]] = field(default_factory=dict)

    def add(self, run: tuple[str, ...]) -> set[str]:
        """Add the keys that the stages of a run read; return their names if the run is new."""
        names: set[str] = set()
        if run in self.nodes:
            return names
        nodes = self.nodes[run] = set()
        for stage, read in _stages(run[0], composed(*run)):
            names.add(stage.__name__)
            for leaf in read:
                nodes.add(leaf.partition(".")[0])
                self.by_leaf.setdefault(leaf, set()).add(stage.__name__)
        self.stages |= names
        return names

    def of(self, key: str) -> set[str]:
        """Return the names of the stages that read a key or any key below it."""
        below = [own for leaf, own in self.by_leaf.items() if f"{leaf}.".startswith(f"{key}.")]
        return set().union(*below)


def options_of(group: str) -> list[str]:
    """List the options of a config group."""
    return sorted(path.stem for path in (conf_folder() / group).glob("*.yaml"))


@cache
def composed(command: str, *overrides: str) -> DictConfig:
    """Compose the config of a command, Hydra's own node included."""
    return compose(command, overrides=[*overrides], return_hydra_config=True)


def in_rounds(options: Mapping[str, Iterable[str]]) -> list[list[str]]:
    """Return overrides for all options of all groups, one option of each group at a time."""
    return [
        [f"{group}={option}" for group, option in zip(options, chosen, strict=True) if option]
        for chosen in zip_longest(*map(sorted, options.values()))
    ]


def find_readers(keys: Mapping[str, Sequence[str]], values: Mapping[str, Sequence[str]]) -> Readers:
    """Compose each row, each model and `avn.generate`, and collect what their stages read.

    Options that none of these chooses are then tried on the runs with the most stages, one of
    each group at a time. Keys that no stage has read by then are looked for in more runs.

    Parameters
    ----------
    keys : mapping of str to sequence of str
        The keys of each group, as any of its options has them.
    values : mapping of str to sequence of str
        Overrides of each group that set a key to another of its values.
    """
    readers = Readers()
    # `plan_*` before `ours_*`, whose settings make others unread
    runs = [("eval", f"agent={row}") for row in reversed(options_of("agent"))]
    runs.append(("eval", "agent=external", f"baseline.observations=[{','.join(OBSERVATIONS)}]"))
    runs.append(("eval", "agent=belief", "episodes=one_sound"))
    runs += [("train", f"model={model}") for model in options_of("model")]
    unseen = {group: set(options_of(group)) for group in keys}
    # recordings, which no stage tells apart, and overrides of other groups
    unseen |= {group: set() for group in ("sound", "condition", "table")}
    kinds: dict[frozenset[str], tuple[str, ...]] = {}
    for run in [*runs, ("generate",)]:
        kinds.setdefault(frozenset(readers.add(run)), run)
        for group in keys:
            cfg = composed(*run)
            # a part that a row has and does not read, such as a stop classifier without Stop
            spare = group in cfg and "_target_" in cfg[group] and cfg[group]["_target_"]
            if group in readers.nodes[run] or not spare:
                unseen[group].discard(cfg.hydra.runtime.choices[group])
    largest = [run for names, run in kinds.items() if not any(names < own for own in kinds)]
    rounds = in_rounds(unseen)
    for run in largest:
        for options in rounds:
            readers.add((*run, *options))
    for group, names in keys.items():
        unread = [name for name in names if not readers.of(name)]
        for run in kinds.values() if unread else ():
            cfg = composed(*run)
            if group in readers.nodes[run] and any(_has(cfg, own) for own in unread):
                others = [[own] for own in values[group] if _has(cfg, own.partition("=")[0])]
                for options in [*rounds, *others]:
                    readers.add((*run, *options))
    return readers


def _has(cfg: DictConfig, key: str) -> bool:
    holder = OmegaConf.select(cfg, key.rpartition(".")[0])
    return isinstance(holder, DictConfig) and key.rpartition(".")[2] in holder


def _stages(command: str, cfg: DictConfig) -> set[tuple[type[Stage], frozenset[str]]]:
    """Return the stages of a run with what they read; none if its settings are not compatible."""
    found: set[tuple[type[Stage], frozenset[str]]] = set()
    try:
        if command == "eval":
            left: list[Stage] = [Evaluation(cfg)]
        elif command == "train":
            left = [MODELS[cfg.model.name][0](cfg)]
        else:
            left = export.stages_of(cfg)
        while left:
            stage = left.pop()
            # no fingerprints, for which weights of optional packages would have to be there
            key = type(stage), frozenset(stage.read_here())
            if key not in found:
                found.add(key)
                left.extend(stage.needed)
    except UserError:
        return set()
    return found
