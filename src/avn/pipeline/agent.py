"""Construction of the agent of a config: a planner with a mapper, or a baseline."""

from __future__ import annotations

from typing import Any

import torch
from omegaconf import DictConfig

from avn.agents.base import Agent
from avn.agents.external import External, build_policy, policy_files
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.hashing import file_hash
from avn.mapping.base import Mapper
from avn.mapping.ego_map import EgoMap
from avn.modules.stop_threshold import check_decision
from avn.navigation.protocols import Protocol
from avn.pipeline import policy, policy_data, stop_classifier
from avn.pipeline.stage import Stage

# Settings of the node `mapper` that are no arguments of its class.
_OTHERS = ("name", "visible_above")


def build_agent(cfg: DictConfig, ready: bool = False) -> Agent:
    """Build the agent that the groups `planner`, `mapper` and `baseline` describe.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    ready : bool
        Whether the agent will act: then its trained network and its stop threshold are read.

    Raises
    ------
    UserError
        Where there is no agent, there are two, or a setting cannot work.
    """
    if cfg.planner._target_ and cfg.baseline._target_:
        raise UserError(
            f"planner, baseline: {cfg.planner.name} and {cfg.baseline._target_.split('.')[-1]} "
            "cannot both act; set one of them to none"
        )
    if cfg.baseline._target_:
        check_no_truth(cfg)
        learnt = policy_data.parts(cfg) if policy.learns(cfg) else {}
        if learnt and ready:
            learnt["network"] = policy.Policy(cfg).load()
        return build_object("baseline", cfg.baseline, map_size=cfg.mapper.size, **learnt)
    if not cfg.planner._target_:
        raise UserError(
            "baseline: 'none' cannot act, and there is no planner; choose random_walk, greedy, "
            "oracle or a3c, or planner=dijkstra"
        )
    if not cfg.mapper._target_:
        raise UserError("mapper: 'none' remembers nothing to plan on; choose occupancy")
    given: dict[str, Any] = {"mapper": build_object("mapper", cfg.mapper)}
    if cfg.agent.oracle_inputs:
        given["oracle_inputs"] = cfg.agent.oracle_inputs
    if ready and decides(cfg):
        given["stop_at"] = stop_classifier.StopNetwork(cfg).threshold()
    return build_object("planner", cfg.planner, **given)


def is_external(cfg: DictConfig) -> bool:
    """Return whether the config's agent is a policy of the user."""
    target = cfg.baseline._target_
    return bool(target) and target == f"{External.__module__}.{External.__qualname__}"


def agent_content(cfg: DictConfig) -> list[Any]:
    """Return what the fingerprint of a run has of the code and the files of the agent's policy.

    The hashes of the files that its arguments name. `Stage.inputs` has the source of its module.
    """
    if not is_external(cfg):
        return []
    agent = build_agent(cfg)
    assert isinstance(agent, External)
    if not agent.policy:  # which `check_agent` refuses
        return []
    files = policy_files(agent.policy, agent.settings)
    return [{name: file_hash(path) for name, path in files.items()}]


def decides(cfg: DictConfig) -> bool:
    """Return whether the agent stops by the probability of the stop classifier."""
    planned = cfg.planner._target_ and cfg.protocol.requires_stop
    if not (planned and stop_classifier.has_stop_model(cfg)):
        return False
    return "stop_probability" in build_agent(cfg).wants(build_object("protocol", cfg.protocol))


def agent_stages(cfg: DictConfig) -> list[Stage]:
    """Return the stages of the agent's own networks, without those of its observations."""
    if policy.learns(cfg):
        return [policy.Policy(cfg)]
    if decides(cfg) and cfg.stop_model.threshold is None:
        return [stop_classifier.StopNetwork(cfg)]
    return []


def agent_settings(cfg: DictConfig) -> list[str]:
    """Return the keys of the config that change the agent's actions."""
    if not cfg.planner._target_:
        maps = is_external(cfg) and "map" in cfg.baseline.observations
        return ["baseline", *(["mapper.size"] if maps else [])]
    decision: list[str] = []
    if decides(cfg):
        selected = cfg.stop_model.threshold is None
        decision = ["stop_model.threshold", *(["stop_model.criterion"] if selected else [])]
    return ["planner", "mapper", *decision]


def agent_ignored(cfg: DictConfig) -> list[str]:
    """Return the keys below those of `agent_settings` that do not change its actions."""
    unread = [f"mapper.{name}" for name in _OTHERS]
    agent, node = build_agent(cfg), "planner" if cfg.planner._target_ else "baseline"
    protocol: Protocol = build_object("protocol", cfg.protocol)
    unread += [f"{node}.{name}" for name in agent.unused_settings(protocol)]
    if cfg.planner._target_:
        mapper: Mapper = build_object("mapper", cfg.mapper)
        unread += [f"mapper.{name}" for name in mapper.unused_settings()]
        if not getattr(agent, "uses_sound_graph", False):
            unread.append("mapper.rooms_above")
    if policy.learns(cfg):
        acting = ("baseline.samples",)
        unused = [key for key in policy.Policy(cfg).ignored() if key.startswith("baseline.")]
        unread += [key for key in unused if key not in acting]
    return unread


def check_agent(cfg: DictConfig, agent: Agent) -> None:
    """Refuse settings that would fail once the agent acts, such as the size of its map."""
    if cfg.planner._target_:
        agent.reset(1, torch.Generator(), build_object("protocol", cfg.protocol))
    if isinstance(agent, External):
        build_policy(agent.policy, agent.settings)
        if "map" in agent.observations:
            EgoMap(1, agent.map_size, agent.map_width)
    if decides(cfg):
        check_decision(cfg.stop_model.criterion, cfg.stop_model.threshold)


def check_no_truth(cfg: DictConfig) -> None:
    """Refuse `agent.oracle_inputs` for a baseline, which cannot use them."""
    if cfg.agent.oracle_inputs:
        raise UserError(
            "agent.oracle_inputs: only agents that plan can be given a part of the truth"
        )
