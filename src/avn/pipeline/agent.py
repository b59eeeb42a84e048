"""The agent of a config: a planner with its mapper, or a baseline."""

from __future__ import annotations

from typing import Any

from omegaconf import DictConfig, OmegaConf

from avn.agents.base import Agent
from avn.core.errors import UserError
from avn.modules.network import build_part
from avn.pipeline import policy, stop_classifier


def build_agent(cfg: DictConfig, ready: bool = False) -> Agent:
    """The agent that the groups `planner`, `mapper` and `baseline` describe.

    Parameters
    ----------
    ready : bool
        Whether it shall walk: then it knows from when to say Stop, for which the stop classifier
        is trained where it is missing.

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
        learnt = policy.parts(cfg, ready) if policy.learns(cfg) else {}
        return build_part(cfg.baseline, "baseline", **learnt)
    if not cfg.planner._target_:
        raise UserError(
            "baseline: 'none' cannot act, and there is no planner; choose random_walk, greedy, "
            "oracle or a3c, or planner=dijkstra"
        )
    if not cfg.mapper._target_:
        raise UserError("mapper: 'none' remembers nothing to plan on; choose occupancy")
    given: dict[str, Any] = {"mapper": build_part(_settings(cfg.mapper)), "truth": cfg.agent.truth}
    if ready and cfg.protocol.says_stop and stop_classifier.can_stop(cfg):
        given["stop_at"] = stop_classifier.stop_threshold(cfg)
    return build_part(cfg.planner, **given)


def acting(cfg: DictConfig) -> list[Any]:
    """The settings by which it acts, for the hash of a run."""
    if not cfg.planner._target_:
        learnt = [policy.policy_hash(cfg)] if policy.learns(cfg) else []
        return [cfg.baseline, *learnt]
    return [cfg.planner, _settings(cfg.mapper)]


def check_no_truth(cfg: DictConfig) -> None:
    """Refuse to give a baseline parts of the truth, which none can use."""
    if cfg.agent.truth:
        raise UserError("agent.truth: only agents that plan can be given a part of the truth")


def _settings(mapper: DictConfig) -> dict[str, Any]:
    """The mapper's own settings, without the recipe of its network."""
    node: Any = OmegaConf.to_container(mapper, resolve=True)
    others = ("name", "visible_above")
    return {key: value for key, value in node.items() if key not in others}
