"""What Hydra must know before it composes: the schema of each group.

Each group's node has a dataclass that stands beside the code it configures, so that a misspelt
key or a wrong type is refused with its name.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hydra.core.config_store import ConfigStore
from omegaconf import II, MISSING

from avn.acoustics.brir import AcousticsConfig
from avn.acoustics.microphone import MicrophoneConfig
from avn.agents.actor_critic import ActorCriticConfig
from avn.agents.base import BaselineConfig
from avn.agents.greedy import GreedyConfig
from avn.agents.planner_agent import PlannerBase, PlannerConfig
from avn.apartments.splits import SplitConfig
from avn.mapping.config import MapperConfig, MemoryConfig
from avn.modules.occupancy_cnn import OccupancyConfig
from avn.modules.sound_cnn import SoundModelConfig
from avn.modules.stop_classifier import StopModelConfig
from avn.navigation.protocols import ProtocolConfig
from avn.rl.config import A3CConfig
from avn.views.backbone import BackboneConfig
from avn.views.cycles import CyclesConfig
from avn.views.raycast import RaycastConfig
from avn.views.renderer import RendererConfig

# Every recipe is trained with the one `train_seed`, unless it is given its own.
_SEED: Any = II("train_seed")
_TEST_SPLIT: Any = II("split")
_TEST_ACOUSTICS: Any = II("acoustics")


@dataclass
class ModelConfig:
    """What `avn.train` trains."""

    name: str = MISSING


@dataclass
class AgentConfig:
    """A row of the table; a privileged one is shown the truth and is a bound, not an entry.

    `truth` names the parts in whose place it is given the truth: location, window, map, pose.
    """

    name: str = MISSING
    privileged: bool = False
    truth: list[str] = field(default_factory=list)


@dataclass
class TrainingConfig:
    """The world in which networks are trained: apartments, acoustics, microphone and sounds.

    Apartments and acoustics are those of the test world, unless they are chosen.
    """

    scenes: SplitConfig = _TEST_SPLIT
    acoustics: AcousticsConfig = _TEST_ACOUSTICS
    microphone: MicrophoneConfig = MISSING
    sounds: dict[str, str] = MISSING


@dataclass
class CoreConfig:
    """What every command has: the groups, and machine settings."""

    split: SplitConfig = MISSING
    acoustics: AcousticsConfig = MISSING
    microphone: MicrophoneConfig = MISSING
    sound: dict[str, str] = MISSING
    training: TrainingConfig = field(default_factory=TrainingConfig)
    sound_model: SoundModelConfig = MISSING
    stop_model: StopModelConfig = MISSING
    protocol: ProtocolConfig = MISSING
    renderer: RendererConfig = MISSING
    backbone: BackboneConfig = MISSING
    occupancy_model: OccupancyConfig = MISSING
    mapper: MapperConfig = MISSING
    planner: PlannerBase = MISSING
    baseline: BaselineConfig = MISSING
    a3c: A3CConfig = field(default_factory=lambda: A3CConfig(train_seed=_SEED))
    look: str = MISSING
    exploration: str = MISSING
    localisation: str = MISSING
    takes: int = MISSING
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
    part: str = MISSING
    # Films made of the run afterwards: how many, and of which episodes. They enter no hash.
    film: int = 0
    film_show: str = "typical"


@dataclass
class ReproduceConfig(CoreConfig):
    """Schema of `reproduce.yaml`."""

    rows: list[str] = MISSING
    sounds: list[str] = MISSING
    seeds: list[int] = MISSING
    train_seeds: list[int] = MISSING


# What every option of a group has. A class from outside the package adds its own parameters.
BASES: dict[str, type] = {
    "sound_model": SoundModelConfig,
    "stop_model": StopModelConfig,
    "occupancy_model": OccupancyConfig,
    "mapper": MapperConfig,
    "planner": PlannerBase,
    "baseline": BaselineConfig,
    "protocol": ProtocolConfig,
    "microphone": MicrophoneConfig,
    "renderer": RendererConfig,
    "backbone": BackboneConfig,
}
# Parameters that the pipeline gives, and no config.
GIVEN = {
    "occupancy_model": ("camera",),
    "planner": ("mapper", "truth", "stop_at"),
    "baseline": ("network", "hears", "maps", "map_size"),
}
# Parameters that follow the setting of the same name, unless they are given.
LINKED = {"train_seed": _SEED, "look": II("look")}
COMMANDS = {
    "generate": GenerateConfig,
    "train": TrainConfig,
    "eval": EvalConfig,
    "reproduce": ReproduceConfig,
}
# The schema of each group that has one; `greedy_schema` and the like are of an option with its
# own settings.
SCHEMAS = {
    ("split", "schema"): SplitConfig,
    ("acoustics", "schema"): AcousticsConfig,
    ("microphone", "schema"): MicrophoneConfig,
    ("sound_model", "schema"): SoundModelConfig(train_seed=_SEED),
    ("stop_model", "schema"): StopModelConfig(train_seed=_SEED),
    ("protocol", "schema"): ProtocolConfig,
    ("renderer", "schema"): RendererConfig,
    ("renderer", "raycast_schema"): RaycastConfig,
    ("renderer", "cycles_schema"): CyclesConfig,
    ("backbone", "schema"): BackboneConfig,
    ("occupancy_model", "schema"): OccupancyConfig(train_seed=_SEED),
    ("mapper", "schema"): MapperConfig,
    ("mapper", "memory_schema"): MemoryConfig,
    ("planner", "schema"): PlannerConfig(look=II("look")),
    ("baseline", "schema"): BaselineConfig,
    ("baseline", "greedy_schema"): GreedyConfig,
    ("baseline", "a3c_schema"): ActorCriticConfig,
}


def register() -> None:
    """Store the schemas; may be called again."""
    store = ConfigStore.instance()
    for (group, name), schema in SCHEMAS.items():
        store.store(group=group, name=name, node=schema)
    for command, schema in COMMANDS.items():
        store.store(name=f"{command}_schema", node=schema)
