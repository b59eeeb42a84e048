"""What the training of an actor-critic needs, from the config of its row."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.core.classes import build_object
from avn.dataset.scene import Scene
from avn.navigation.protocols import Protocol
from avn.navigation.scene_batch import SceneBatch
from avn.pipeline.policy_data import (
    SUBSETS,
    feature_sizes,
    load_subset,
    network_spec,
    tables_of,
)
from avn.pipeline.policy_measure import Measure
from avn.rl.algorithm import Algorithm
from avn.rl.exploration_memory import draw_trajectories
from avn.rl.networks import ActorCritic
from avn.rl.worker import TrainingSpec

# Maximum number of rows from which mean and standard deviation of a feature are estimated.
_EXAMPLES = 200_000


def prepare(cfg: DictConfig, recipe: Algorithm) -> tuple[TrainingSpec, ActorCritic, Measure]:
    """Return the specification of a training, the initial network and its evaluation."""
    opened = {subset: load_subset(cfg, subset) for subset in SUBSETS}
    tables = tables_of(cfg, opened["train"])
    protocol: Protocol = build_object("protocol", cfg.protocol)
    network = _initial(cfg, recipe, tables)
    spec = TrainingSpec(
        tables=tables,
        protocol=protocol,
        network_spec=network.spec,
        recipe=recipe,
        buffers=dict(network.named_buffers()),
        map_size=cfg.mapper.size,
        trajectories=_trajectories(cfg, opened["train"][0], tables),
        top=cfg.baseline.top,
    )
    return spec, network, Measure(cfg, opened, protocol, recipe.validation_starts)


def _initial(cfg: DictConfig, recipe: Algorithm, tables: SceneBatch) -> ActorCritic:
    """Build the network with its initial weights; its features are standardised."""
    features = feature_sizes(cfg, tables)
    torch.manual_seed(recipe.train_seed)
    network = ActorCritic(network_spec(cfg, features))
    for name in features:
        table = tables.visual.get(name, tables.audio.get(name))
        assert table is not None
        network.standardise(name, table[:: max(1, len(table) // _EXAMPLES)])
    return network


def _trajectories(cfg: DictConfig, scenes: Sequence[Scene], tables: SceneBatch) -> Tensor | None:
    if not cfg.baseline.memory:
        return None
    steps = cfg.protocol.exploration_steps
    return draw_trajectories(
        [*scenes], tables, cfg.algorithm.exploration_walks, steps, cfg.algorithm.train_seed
    )
