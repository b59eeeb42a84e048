"""Rollouts of an agent in the simulator, and the records of its episodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS, action_error
from avn.core.errors import UserError
from avn.core.random import derive
from avn.navigation.distances import actions_to_cells, fewest_actions
from avn.navigation.dynamics import Dynamics
from avn.navigation.episodes import Episodes
from avn.navigation.metrics import dynamic_spl, sna, soft_spl, spl
from avn.navigation.motion import earliest_catch
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator

if TYPE_CHECKING:
    from tensordict import TensorDict

# Callback of a rollout. Its arguments are the simulator, the agent, the observation and the actions
# that follow, which are None after the last step. The rollout ends if it returns True.
Watch = Callable[[Simulator, Agent, "TensorDict", Tensor | None], bool]


@dataclass(frozen=True)
class Labels:
    """Values of the records that the simulator does not know.

    Attributes
    ----------
    agent : str
        Name of the agent.
    acoustics : str
        Name of the acoustics.
    look : {"once", "around"}
        See `PlannerAgent`.
    """

    agent: str
    acoustics: str
    look: str = "once"


def rollout_scene(
    agent: Agent,
    scene: NavigationScene,
    episodes: Episodes,
    protocol: Protocol,
    labels: Labels,
    observations: SceneObservations | None = None,
    watch: Watch | None = None,
    dynamics: Dynamics | None = None,
) -> pd.DataFrame:
    """Run an agent in all episodes of a scene at once.

    The random numbers of the agent are a function of the episodes' seed and the scene, so equal
    calls give equal records.

    Parameters
    ----------
    agent : Agent
        Acts in the episodes.
    scene : NavigationScene
        Apartment of the episodes.
    episodes : Episodes
        Sound, source and start of each episode.
    protocol : Protocol
        Actions, goal and limits of an episode.
    labels : Labels
        Values of the records that the simulator does not know.
    observations : SceneObservations, optional
        Audio and visual observations of the scene.
    watch : callable, optional
        Called at each step; see `Watch`. If it ends the rollout early, the records of unfinished
        episodes are not valid.
    dynamics : Dynamics, optional
        What changes in the course of an episode; nothing by default.

    Returns
    -------
    DataFrame
        One row for each episode, with the columns `avn.reporting.results.EPISODE_COLUMNS` and
        those of what changes in the course of the episodes.

    Raises
    ------
    UserError
        If an observation or the exploration that the agent needs is missing.
    """
    simulator = Simulator(scene, episodes, protocol, observations, dynamics)
    rollout(agent, simulator, watch)
    return records(simulator, labels)


def rollout(agent: Agent, simulator: Simulator, watch: Watch | None = None) -> None:
    """Run all episodes of a simulator to their end.

    The agent gets observations alone; a privileged agent is also given the simulator.

    Parameters
    ----------
    agent : Agent
        Acts in the episodes.
    simulator : Simulator
        Reset before the first action.
    watch : callable, optional
        Called at each step; see `Watch`.

    Raises
    ------
    UserError
        If an observation or the exploration that the agent needs is missing, or its actions are
        not an (N,) int64 tensor of actions of the protocol.
    """
    observation = simulator.reset()
    for key in sorted(set(agent.wants(simulator.protocol)) - set(observation.keys())):
        raise UserError(
            f"agent {type(agent).__name__} needs the observation '{key}', which is not there; "
            f"there are {', '.join(sorted(observation.keys()))}"
        )
    episodes = simulator.episodes
    generator = torch.Generator().manual_seed(derive("agent", episodes.seed, episodes.scene) >> 1)
    agent.reset(len(simulator), generator, simulator.protocol)
    if agent.explores:
        if not len(episodes.trajectories):
            raise UserError(
                f"episodes: agent {type(agent).__name__} explores first, and these episodes have "
                "no exploration walk; take episodes=frozen and protocol.exploration_steps=400"
            )
        agent.explore(*simulator.observe_exploration())
    if agent.privileged:
        agent.set_ground_truth(simulator)
    with torch.inference_mode():
        while not bool(simulator.done.all()):
            actions = agent.act(observation)
            _check_actions(agent, simulator, actions)
            if watch and watch(simulator, agent, observation, actions):
                return
            observation = simulator.step(actions)
            agent.set_active(~simulator.done)
    if watch:
        watch(simulator, agent, observation, None)


def _check_actions(agent: Agent, simulator: Simulator, actions: Tensor) -> None:
    protocol = simulator.protocol
    if error := action_error(actions, len(simulator), protocol.actions, protocol.name):
        raise UserError(f"agent {type(agent).__name__}: {error}")


def records(simulator: Simulator, labels: Labels) -> pd.DataFrame:
    """Tabulate the episodes of a simulator that has run to its end, one row for each."""
    scene, episodes, protocol = simulator.scene, simulator.episodes, simulator.protocol
    distances = simulator.distances
    source, start = episodes.source, episodes.start // HEADINGS
    end = simulator.state.numpy() // HEADINGS
    centres = scene.grid.centres
    metres = CELL * simulator.moves.numpy().astype(np.float64)
    path = (
        metres
        if protocol.path_length == "metres"
        else simulator.attempted.numpy().astype(np.float64)
    )
    last, place = simulator.to_source()
    shortest, remaining = distances.shortest[source, start], last.shortest[place.numpy(), end]
    success, actions = simulator.success.numpy(), simulator.actions.numpy()
    fewest, to_source = _fewest(simulator), _fewest_to_source(simulator)
    return pd.DataFrame(
        {
            "agent": labels.agent,
            "protocol": protocol.name,
            "acoustics": labels.acoustics,
            "look": labels.look,
            "sound": np.array(episodes.sounds, dtype=object)[episodes.sound],
            "scene": scene.name,
            "seed": episodes.seed,
            "episode": episodes.number,
            "start_cell": start,
            "start_heading": episodes.start % HEADINGS,
            "source": source,
            "source_cell": np.asarray(scene.sources)[source],
            "in_sight": scene.in_sight[source, start].astype(np.int64),
            "rooms_crossed": distances.crossings[source, start],
            "geodesic": CELL * distances.source_moves[source, start],
            "euclidean": np.hypot(*(centres[start] - centres[np.asarray(scene.sources)[source]]).T),
            "end_cell": end,
            "path_length": path,
            "shortest": shortest,
            "actions": actions,
            "fewest_actions": fewest,
            "fewest_actions_to_source": to_source,
            "collisions": simulator.collisions.numpy(),
            "outcome": _outcome(simulator),
            "success": success.astype(np.int64),
            "spl": spl(success, path, shortest),
            "softspl": soft_spl(remaining, path, shortest),
            "sna": sna(success, actions, to_source),
            "dtg": CELL * last.source_moves[place.numpy(), end],
            "sna_goal": sna(success, actions, fewest),
        }
        | _course(simulator)
    )


def _course(simulator: Simulator) -> dict[str, np.ndarray]:
    """Return the columns of what changed in the course of the episodes; none if nothing did."""
    course, dynamics = simulator.course, simulator.course.dynamics
    found: dict[str, np.ndarray] = {}
    if dynamics.schedule:
        silent = simulator.success & (simulator.actions > course.end)
        found["sound_begins"], found["sound_ends"] = course.begin.numpy(), course.end.numpy()
        found["success_when_silent"] = silent.numpy().astype(np.int64)
    if dynamics.distractor:
        names = np.array(simulator.episodes.sounds, dtype=object)
        found["distractor"] = course.other_source.numpy()
        found["distractor_sound"] = names[course.other_sound.numpy()]
        if simulator.protocol.requires_stop:
            near = simulator.distances.goal[
                found["distractor"], simulator.state.numpy() // HEADINGS
            ]
            found["stopped_at_distractor"] = (near & simulator.stopped.numpy()).astype(np.int64)
    if dynamics.odometry:
        found["slips"] = simulator.slips.numpy()
        found["drift"] = CELL * simulator.drift().numpy()
    return found | _motion(simulator)


def _motion(simulator: Simulator) -> dict[str, np.ndarray]:
    """Return the columns of a moving source; none if it stays where it is."""
    walk, episodes = simulator.course.walk, simulator.episodes
    if walk is None:
        return {}
    last, place = simulator.to_source()
    stop = int(simulator.protocol.requires_stop)
    # a Stop is an action too
    walk = walk[:, : simulator.protocol.max_actions + 1 - stop]
    fewest, _ = earliest_catch(simulator.scene.grid, last.goal, walk.numpy(), episodes.start)
    before = simulator.distances.source_moves[episodes.source, episodes.start // HEADINGS]
    after = last.source_moves[place.numpy(), simulator.state.numpy() // HEADINGS]
    success, actions = simulator.success.numpy(), simulator.actions.numpy()
    return {
        "source_end_cell": place.numpy(),
        "fewest_actions_to_catch": fewest + stop,
        "dspl": dynamic_spl(success, actions, fewest + stop),
        "ndtg": after / before,
    }


def _fewest(simulator: Simulator) -> np.ndarray:
    """Return the fewest actions that succeed on a path with p <= l, including Stop, (N,)."""
    episodes, distances = simulator.episodes, simulator.distances
    allowance = distances.allowance[episodes.source, episodes.start // HEADINGS]
    neighbours = simulator.scene.grid.neighbours
    costs = fewest_actions(neighbours, distances.goal, int(allowance.max()))
    own = costs[allowance, episodes.source, episodes.start].astype(np.int64)
    return own + int(simulator.protocol.requires_stop)


def _fewest_to_source(simulator: Simulator) -> np.ndarray:
    """Return the fewest actions to the source's cell, including Stop, (N,)."""
    scene, episodes = simulator.scene, simulator.episodes
    costs = actions_to_cells(scene.grid.neighbours, np.asarray(scene.sources))
    own: np.ndarray = costs[episodes.source, episodes.start]
    return own + int(simulator.protocol.requires_stop)


def _outcome(simulator: Simulator) -> np.ndarray:
    """Return the outcome of each episode, a word, (N,)."""
    out_of_moves = simulator.attempted >= simulator.max_attempts
    cases = [simulator.success, simulator.stopped, out_of_moves]
    words = ["success", "stopped_elsewhere", "out_of_moves"]
    return np.select([case.numpy() for case in cases], words, "out_of_actions")
