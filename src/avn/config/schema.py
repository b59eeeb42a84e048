"""What Hydra must know before it composes: the schema of each command and of each group.

A misspelt key or a wrong type is refused with its name. The settings of a class stand in its
signature, see `avn.config.signatures`; here is what the options of a group have in common.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from omegaconf import II, MISSING

from avn.acoustics.brir import AcousticsConfig
from avn.apartments.splits import SplitConfig
from avn.views.backbone import BackboneConfig
from avn.views.renderer import RendererConfig

_TEST_SPLIT: Any = II("split")
_TEST_ACOUSTICS: Any = II("acoustics")


@dataclass
class Option:
    """What an option of any group has: the class that it is of, null for none.

    Attributes
    ----------
    _target_ : str or None
        Module and name of the class.
    """

    _target_: str | None = None


@dataclass
class NamedOption(Option):
    """An option with a name, for titles and folders.

    Attributes
    ----------
    name : str
        What the option is called.
    """

    name: str = MISSING


@dataclass
class MapperOption(NamedOption):
    """What every option of the group `mapper` has.

    Attributes
    ----------
    size : int
        Squares along each side of the map, odd.
    visible_above : float
        Squares that are visible with a lower probability tell nothing of being free.
    """

    size: int = 101
    visible_above: float = 0.0


@dataclass
class ModelConfig:
    """What `avn.train` trains.

    Attributes
    ----------
    name : str
        Kind of network, a key of `avn.pipeline.models.MODELS`.
    """

    name: str = MISSING


@dataclass
class AgentConfig:
    """A row of the table; a privileged one is shown the truth and is a bound, not an entry.

    Attributes
    ----------
    name : str
        Name of the row.
    privileged : bool
        Whether the agent is shown the truth; the row has to say so.
    oracle_inputs : list of str
        Parts in whose place it is given the truth: `source_estimate`, `local_patch`, `map`, `pose`.
    """

    name: str = MISSING
    privileged: bool = False
    oracle_inputs: list[str] = field(default_factory=list)


@dataclass
class TrainingConfig:
    """The world in which networks are trained: apartments, acoustics, microphone and sounds.

    Apartments and acoustics are those of the test world, unless they are chosen.

    Attributes
    ----------
    scenes : SplitConfig
        The split of the training world, an option of `split`.
    acoustics : AcousticsConfig
        The acoustics of the training world, an option of `acoustics`.
    microphone : Option
        The microphone of the training world, an option of `microphone`.
    sounds : dict of str to str
        The sounds of the training world, an option of `sound`.
    """

    scenes: SplitConfig = _TEST_SPLIT
    acoustics: AcousticsConfig = _TEST_ACOUSTICS
    microphone: Option = MISSING
    sounds: dict[str, str] = MISSING


@dataclass
class CoreConfig:
    """What every command has: the groups, and machine settings.

    Attributes
    ----------
    sound : dict of str to str
        For each name of a sound the recording: one that the package ships, or a file's path.
    """

    split: SplitConfig = MISSING
    acoustics: AcousticsConfig = MISSING
    microphone: Option = MISSING
    sound: dict[str, str] = MISSING
    training: TrainingConfig = field(default_factory=TrainingConfig)
    sound_model: NamedOption = MISSING
    stop_model: NamedOption = MISSING
    protocol: NamedOption = MISSING
    renderer: RendererConfig = MISSING
    backbone: BackboneConfig = MISSING
    occupancy_model: NamedOption = MISSING
    mapper: MapperOption = MISSING
    planner: NamedOption = MISSING
    baseline: Option = MISSING
    algorithm: Option = MISSING
    look: str = MISSING
    exploration: str = MISSING
    localisation: str = MISSING
    realisations: int = MISSING
    train_seed: int = MISSING
    outputs: str = MISSING
    processes: int = MISSING
    auto: bool = MISSING


@dataclass
class GenerateConfig(CoreConfig):
    """Schema of `generate.yaml`."""

    apartments: list[str] = MISSING
    export: str | None = None
    clips: list[list[int]] = MISSING


@dataclass
class TrainConfig(CoreConfig):
    """Schema of `train.yaml`."""

    model: ModelConfig = MISSING
    # The row whose agent is trained, for `model=a3c_v` and the like.
    agent: AgentConfig = field(default_factory=lambda: AgentConfig(name="none"))


@dataclass
class EvalConfig(CoreConfig):
    """Schema of `eval.yaml`."""

    agent: AgentConfig = MISSING
    seed: int = MISSING
    episodes: str = MISSING
    subset: str = MISSING
    film: int = MISSING
    film_show: str = MISSING


@dataclass
class ReproduceConfig(CoreConfig):
    """Schema of `reproduce.yaml`."""

    rows: list[str] = MISSING
    sounds: list[str] = MISSING
    seeds: list[int] = MISSING
    train_seeds: list[int] = MISSING


# What every option of a group has.
BASES: dict[str, type] = {
    "sound_model": NamedOption,
    "stop_model": NamedOption,
    "occupancy_model": NamedOption,
    "mapper": MapperOption,
    "planner": NamedOption,
    "baseline": Option,
    "protocol": NamedOption,
    "algorithm": Option,
    "microphone": Option,
    "renderer": RendererConfig,
    "backbone": BackboneConfig,
}
# Parameters that the pipeline gives, and no config.
GIVEN = {
    "sound_model": ("rate",),
    "stop_model": ("rate",),
    "occupancy_model": ("camera",),
    "planner": ("mapper", "oracle_inputs", "stop_at"),
    "baseline": ("network", "hears", "maps", "map_size"),
    # of the part of a network that has this key
    "spectrogram": ("rate",),
    "net": ("channels", "height", "width", "outputs", "camera"),
}
# Parameters that follow the setting of the same name, unless they are given.
LINKED = {name: II(name) for name in ("train_seed", "look", "localisation")}
COMMANDS = {
    "generate": GenerateConfig,
    "train": TrainConfig,
    "eval": EvalConfig,
    "reproduce": ReproduceConfig,
}
# Groups whose options are values of one dataclass.
SCHEMAS = {"split": SplitConfig, "acoustics": AcousticsConfig}
