"""What Hydra must know before it composes: the schema of each group and our resolvers.

Each group's node has a dataclass that stands beside the code it configures, so that a misspelt
key or a wrong type is refused with its name.
"""

from __future__ import annotations

from hydra.core.config_store import ConfigStore
from omegaconf import DictConfig, OmegaConf

from avn.acoustics.brir import AcousticsConfig
from avn.acoustics.clips import MicrophoneConfig
from avn.agents.base import BaselineConfig
from avn.apartments.splits import SplitConfig
from avn.modules.sound_cnn import SoundModelConfig
from avn.navigation.protocols import ProtocolConfig

SCHEMAS = {
    "split": SplitConfig,
    "acoustics": AcousticsConfig,
    "microphone": MicrophoneConfig,
    "sound_model": SoundModelConfig,
    "protocol": ProtocolConfig,
    "baseline": BaselineConfig,
}

# Nodes without a dataclass, and the keys they may have.
KEYS = {"agent": ("name",), "model": ("name",)}


def register() -> None:
    """Store the schemas as `<group>/schema` and register the resolvers; may be called again."""
    store = ConfigStore.instance()
    for group, schema in SCHEMAS.items():
        store.store(group=group, name="schema", node=schema)
    OmegaConf.register_new_resolver("run_dir", _run_dir, replace=True)
    OmegaConf.register_new_resolver("model_dir", _model_dir, replace=True)


def _run_dir(*, _root_: DictConfig) -> str:
    from avn import pipeline

    return pipeline.run_folder_name(_root_)


def _model_dir(*, _root_: DictConfig) -> str:
    from avn import pipeline

    return pipeline.model_folder_name(_root_)
