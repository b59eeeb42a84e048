"""Schemas of the commands' configs and of the config groups.

Hydra refuses misspelt keys and wrong types by them. The settings of a class are the parameters of
its constructor, see `avn.config.signatures`; the schemas here are common to all options of a group.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from omegaconf import II, MISSING

from avn.acoustics.settings import AcousticsConfig
from avn.apartments.settings import SplitConfig
from avn.modules.settings import TrainerConfig
from avn.views.settings import BackboneConfig, RendererConfig

_TEST_SPLIT: Any = II("split")
_TEST_ACOUSTICS: Any = II("acoustics")


@dataclass
class Option:
    """Option of a config group.

    Attributes
    ----------
    _target_ : str or None
        Module and name of the class that the option builds; null for none.
    """

    _target_: str | None = None


@dataclass
class NamedOption(Option):
    """Option with a name, for titles and folders.

    Attributes
    ----------
    name : str
        Name of the option.
    """

    name: str = MISSING


@dataclass
class NetworkOption(NamedOption):
    """Option of a group of networks.

    Attributes
    ----------
    ckpt_path : str, optional
        Checkpoint of another training, `best.ckpt` or `last.ckpt`, from which that of this network
        goes on: weights, optimiser, number of epochs.
    """

    ckpt_path: str | None = None


@dataclass
class AlgorithmOption(Option):
    """Option of the group `algorithm`.

    Attributes
    ----------
    ckpt_path : str, optional
        Checkpoint `last.ckpt` of another training, from which this one goes on: weights, moments,
        number of actions.
    """

    ckpt_path: str | None = None


@dataclass
class MapperOption(NamedOption):
    """Option of the group `mapper`.

    Attributes
    ----------
    size : int
        Side of the map in cells, an odd number.
    visible_above : float
        Minimum probability of being visible, 0 to 1, at which the occupancy estimate of a cell is
        used.
    """

    size: int = 101
    visible_above: float = 0.0


@dataclass
class ModelConfig:
    """Model that `avn.train` trains.

    Attributes
    ----------
    name : str
        Kind of network, a key of `avn.pipeline.models.MODELS`.
    """

    name: str = MISSING


@dataclass
class AgentConfig:
    """Row of the results table.

    Attributes
    ----------
    name : str
        Name of the row, in tables and folders.
    privileged : bool
        Whether the agent has access to ground truth; such a row is a bound, not a competitor.
    oracle_inputs : list of str
        Inputs that are replaced by ground truth: `source_estimate`, `local_patch`, `map`, `pose`.
    """

    name: str = MISSING
    privileged: bool = False
    oracle_inputs: list[str] = field(default_factory=list)


@dataclass
class TrainingConfig:
    """Training world: the apartments, acoustics, microphone and sounds that networks train on.

    Apartments and acoustics are those of the test world unless they are set.

    Attributes
    ----------
    scenes : SplitConfig
        Split of the training world, an option of `split`.
    acoustics : AcousticsConfig
        Acoustics of the training world, an option of `acoustics`.
    microphone : Option
        Microphone of the training world, an option of `microphone`.
    sounds : dict of str to str
        Sounds of the training world, an option of `sound`.
    generated : int
        Generated apartments that networks train on besides those of a folder of `scenes`: the first
        training apartments of `split=procedural`; 0 or more.
    """

    scenes: SplitConfig = _TEST_SPLIT
    acoustics: AcousticsConfig = _TEST_ACOUSTICS
    microphone: Option = MISSING
    sounds: dict[str, str] = MISSING
    generated: int = 0


@dataclass
class CoreConfig:
    """Settings of all commands: the config groups and machine settings.

    Attributes
    ----------
    sound : dict of str to str
        Recording of each sound by its name: one of the package or the path of an audio file.
    logger, callbacks : dict
        Loggers and further callbacks of trainings by name, each with `_target_` and arguments of
        that class.
    """

    split: SplitConfig = MISSING
    acoustics: AcousticsConfig = MISSING
    microphone: Option = MISSING
    schedule: NamedOption = MISSING
    distractor: NamedOption = MISSING
    odometry: NamedOption = MISSING
    motion: NamedOption = MISSING
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
    numerics: str = MISSING
    trainer: TrainerConfig = MISSING
    logger: dict[str, Any] = MISSING
    callbacks: dict[str, Any] = MISSING
    policy: str | None = None
    outputs: str = MISSING
    processes: int = MISSING
    auto: bool = MISSING
    force: bool = MISSING


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
    ckpt_path: str | None = None
    # Row whose agent is trained, for `model=a3c_v` and the like.
    agent: AgentConfig = field(default_factory=lambda: AgentConfig(name="none"))


@dataclass
class EvalConfig(CoreConfig):
    """Schema of `eval.yaml`."""

    agent: AgentConfig = MISSING
    seed: int = MISSING
    episodes: str = MISSING
    subset: str = MISSING
    networks: str = MISSING
    film: int = MISSING
    film_show: str = MISSING
    film_speed: float = MISSING


@dataclass
class ReproduceConfig(CoreConfig):
    """Schema of `reproduce.yaml`."""

    rows: list[str] = MISSING
    conditions: list[str] = MISSING
    world: list[str] = MISSING
    sounds: list[str] = MISSING
    seeds: list[int] = MISSING
    train_seeds: list[int] = MISSING
    networks: str = MISSING


# Schema that all options of a group share.
BASES: dict[str, type] = {
    "sound_model": NetworkOption,
    "stop_model": NetworkOption,
    "occupancy_model": NetworkOption,
    "mapper": MapperOption,
    "planner": NamedOption,
    "baseline": Option,
    "protocol": NamedOption,
    "algorithm": AlgorithmOption,
    "microphone": Option,
    "schedule": NamedOption,
    "distractor": NamedOption,
    "odometry": NamedOption,
    "motion": NamedOption,
    "renderer": RendererConfig,
    "backbone": BackboneConfig,
}
# Base class of the classes of a group.
INTERFACES = {
    "sound_model": "avn.modules.sound_cnn.SoundCnn",
    "stop_model": "avn.modules.stop_classifier.StopClassifier",
    "occupancy_model": "avn.modules.occupancy_cnn.OccupancyCnn",
    "mapper": "avn.mapping.base.Mapper",
    "planner": "avn.agents.base.Agent",
    "baseline": "avn.agents.base.Agent",
    "protocol": "avn.navigation.protocols.Protocol",
    "algorithm": "avn.rl.algorithm.Algorithm",
    "microphone": "avn.acoustics.microphone.Microphone",
    "schedule": "avn.navigation.schedule.Schedule",
    "distractor": "avn.navigation.distractor.Distractor",
    "odometry": "avn.navigation.odometry_noise.OdometryNoise",
    "motion": "avn.navigation.motion.Motion",
    "renderer": "avn.views.renderer.Renderer",
    "backbone": "avn.views.backbone.Backbone",
}
# Parameters that the pipeline sets and no config.
GIVEN = {
    "sound_model": ("rate",),
    "stop_model": ("rate",),
    "occupancy_model": ("camera",),
    "planner": ("mapper", "oracle_inputs", "stop_at"),
    "distractor": ("categories",),
    "baseline": ("network", "hears", "maps", "map_size"),
    # of the submodule of a network under this key
    "spectrogram": ("rate",),
    "net": ("channels", "height", "width", "outputs", "camera"),
}
# Parameters whose default is the setting of the same name.
LINKED = {name: II(name) for name in ("train_seed", "look", "localisation")}
COMMANDS = {
    "generate": GenerateConfig,
    "train": TrainConfig,
    "eval": EvalConfig,
    "reproduce": ReproduceConfig,
}
# Groups whose options are instances of one dataclass.
SCHEMAS = {"split": SplitConfig, "acoustics": AcousticsConfig, "trainer": TrainerConfig}
