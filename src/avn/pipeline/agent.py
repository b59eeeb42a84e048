"""The agent of a config: a planner with its mapper, or a baseline."""

from __future__ import annotations

from typing import Any

import torch
from omegaconf import DictConfig

from avn.agents.base import Agent
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.mapping.base import Mapper
from avn.modules.stop_classifier import check_decision
from avn.navigation.protocols import Protocol
from avn.pipeline import policy, stop_classifier
from avn.pipeline.stage import Stage

# Settings of the nodes `mapper` and `planner` that are no arguments of their classes.
_OTHERS = ("name", "visible_above")


def build_agent(cfg: DictConfig, ready: bool = False) -> Agent:
    """The agent that the groups `planner`, `mapper` and `baseline` describe.

    Parameters
    ----------
    ready : bool
        Whether it shall act: then its network is read, and from when on to say Stop.

    Raises
    ------
    UserError
        Where nothing acts, two things do, or a setting cannot work.
    """
    if cfg.planner._target_ and cfg.baseline._target_:
        raise UserError(
            f"planner, baseline: {cfg.planner.name} and {cfg.baseline._target_.split('.')[-1]} "
            "cannot both act; set one of them to none"
        )
    if cfg.baseline._target_:
        check_no_truth(cfg)
        learnt = policy.parts(cfg) if policy.learns(cfg) else {}
        if learnt and ready:
            learnt["network"] = policy.Policy(cfg).load()
        return build_object("baseline", cfg.baseline, **learnt)
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


def decides(cfg: DictConfig) -> bool:
    """Whether the agent says Stop by the probability of the stop classifier."""
    return bool(
        cfg.planner._target_ and cfg.protocol.requires_stop and stop_classifier.can_stop(cfg)
    )


def agent_stages(cfg: DictConfig) -> list[Stage]:
    """The networks that the agent acts with, beside those that make what it observes."""
    if policy.learns(cfg):
        return [policy.Policy(cfg)]
    if decides(cfg) and cfg.stop_model.threshold is None:
        return [stop_classifier.StopNetwork(cfg)]
    return []


def agent_settings(cfg: DictConfig) -> list[str]:
    """Keys of the config by which it acts."""
    if not cfg.planner._target_:
        return ["baseline"]
    decision: list[str] = []
    if decides(cfg):
        chosen = cfg.stop_model.threshold is None
        decision = ["stop_model.threshold", *(["stop_model.criterion"] if chosen else [])]
    return ["planner", "mapper", *decision]


def agent_ignored(cfg: DictConfig) -> list[str]:
    """Keys below those of `agent_settings` that make no difference to it."""
    unread = [f"mapper.{name}" for name in _OTHERS]
    agent, node = build_agent(cfg), "planner" if cfg.planner._target_ else "baseline"
    protocol: Protocol = build_object("protocol", cfg.protocol)
    unread += [f"{node}.{name}" for name in agent.unused_settings(protocol)]
    if cfg.planner._target_:
        mapper: Mapper = build_object("mapper", cfg.mapper)
        unread += [f"mapper.{name}" for name in mapper.unused_settings()]
    if policy.learns(cfg):
        acting = ("baseline.samples",)
        own = [key for key in policy.Policy(cfg).ignored() if key.startswith("baseline.")]
        unread += [key for key in own if key not in acting]
    return unread


def check_agent(cfg: DictConfig, agent: Agent) -> None:
    """Refuse what an agent would stumble over once it acts, such as the size of its map."""
    if cfg.planner._target_:
        agent.reset(1, torch.Generator(), build_object("protocol", cfg.protocol))
    if decides(cfg):
        check_decision(cfg.stop_model.criterion, cfg.stop_model.threshold)


def check_no_truth(cfg: DictConfig) -> None:
    """Refuse to give a baseline parts of the truth, which none can use."""
    if cfg.agent.oracle_inputs:
        raise UserError(
            "agent.oracle_inputs: only agents that plan can be given a part of the truth"
        )
