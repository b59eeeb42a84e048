"""Settings of the config group `split`; importing them needs no numerical library."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class SplitConfig:
    """Settings of the config group `split`.

    Attributes
    ----------
    name : str
        Name of the split, as in the names of runs.
    folder : str, optional
        Frozen floor plans: a folder under the package's `assets/floor_plans`, or any folder.
        Files `train_*.json`, `val_*.json`; all others are test apartments. The settings below are
        those of generated apartments and are not read with a folder.
    seed : int
        Seed of the generator. An apartment depends on it, on its part and on its number in the
        part, and not on the number of apartments.
    size : str
        Size of generated apartments, a key of `avn.apartments.generator.SIZES`.
    train, validation, test : int
        Number of apartments to generate.
    train_sources, sources : int
        Number of source cells of each training apartment, and of each other one.
    hashes : str, optional
        Generated apartments that are frozen: a table of hashes of floor plans in the package's
        `assets/floor_plan_hashes`. An apartment with another hash is refused. null for none.
    more_training : int
        Default of `training.generated` for rows whose networks train on generated apartments too.
    total_steps, validate_every : int
        Defaults of `algorithm.total_steps` and `algorithm.validate_every` of `algorithm=a3c` for
        agents that are trained on this split.
    """

    name: str = "var"
    folder: str | None = None
    seed: int = 0
    size: str = "mixed"
    train: int = 2
    validation: int = 3
    test: int = 5
    train_sources: int = 10
    sources: int = 5
    hashes: str | None = None
    more_training: int = 0
    total_steps: int = 3_000_000
    validate_every: int = 250_000
