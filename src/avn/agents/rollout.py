"""The loop in which an agent walks all episodes of a room, and the records it leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.random import derive
from avn.navigation.distances import fewest_actions
from avn.navigation.episodes import Episodes
from avn.navigation.metrics import sna, soft_spl, spl
from avn.navigation.observations import SceneObservations
from avn.navigation.place import Place
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator

# What looks on at a walk: it is shown simulator and agent, what is observed, and the actions that
# follow, which are None when all episodes are over; it says whether it has seen enough.
Watch = Callable[[Simulator, Agent, TensorDict, Tensor | None], bool]


@dataclass(frozen=True)
class Labels:
    """What the records say of a run beside what the simulator knows."""

    agent: str
    acoustics: str
    look: str = "once"


def rollout_scene(
    agent: Agent,
    place: Place,
    episodes: Episodes,
    protocol: Protocol,
    labels: Labels,
    observations: SceneObservations | None = None,
    watch: Watch | None = None,
) -> pd.DataFrame:
    """Let an agent walk all episodes of a room at once.

    What the agent draws comes from the episodes' seed and the room, so that the same call gives
    the same records.

    Parameters
    ----------
    observations : SceneObservations, optional
        What can be heard and seen there.
    watch : callable, optional
        Looks on; see `Watch`. When it has seen enough the walk is broken off, and what the records
        say of episodes that still run is void.

    Returns
    -------
    DataFrame
        One row an episode; the columns are `avn.reporting.results.EPISODE_COLUMNS`.

    Raises
    ------
    UserError
        Where the agent needs an observation that is not there.
    """
    simulator = Simulator(place, episodes, protocol, observations)
    walk(agent, simulator, watch)
    return records(simulator, labels)


def walk(agent: Agent, simulator: Simulator, watch: Watch | None = None) -> None:
    """Run all episodes of a simulator to their end.

    An agent gets observations and nothing else; only one that says it is privileged is shown the
    simulator.
    """
    observation = simulator.reset()
    for key in sorted(set(agent.wants(simulator.protocol)) - set(observation.keys())):
        raise UserError(
            f"agent {type(agent).__name__} needs the observation '{key}', which is not there; "
            f"there are {', '.join(sorted(observation.keys()))}"
        )
    episodes = simulator.episodes
    generator = torch.Generator().manual_seed(derive("agent", episodes.seed, episodes.room) >> 1)
    agent.reset(len(simulator), generator, simulator.protocol)
    if agent.explores:
        if not len(episodes.walks):
            raise UserError(
                f"episodes: agent {type(agent).__name__} explores first, and these episodes have "
                "no exploration walk; take episodes=frozen and protocol.exploration_steps=400"
            )
        agent.explore(*simulator.explored())
    if agent.privileged:
        agent.reveal(simulator)
    with torch.inference_mode():
        while not bool(simulator.done.all()):
            actions = agent.act(observation)
            if watch and watch(simulator, agent, observation, actions):
                return
            observation = simulator.step(actions)
            agent.rest(simulator.done)
    if watch:
        watch(simulator, agent, observation, None)


def records(simulator: Simulator, labels: Labels) -> pd.DataFrame:
    """One row for each episode of a simulator that has run to its end."""
    place, episodes, protocol = simulator.place, simulator.episodes, simulator.protocol
    distances = simulator.distances
    source, start = episodes.source, episodes.start // HEADINGS
    end = simulator.state.numpy() // HEADINGS
    centres = place.grid.centres
    walked = CELL * simulator.walked.numpy().astype(np.float64)
    path = (
        walked
        if protocol.path_length == "metres"
        else simulator.attempted.numpy().astype(np.float64)
    )
    shortest, remaining = distances.shortest[source, start], distances.shortest[source, end]
    success, actions = simulator.success.numpy(), simulator.actions.numpy()
    fewest = _fewest(simulator)
    return pd.DataFrame(
        {
            "agent": labels.agent,
            "protocol": protocol.name,
            "acoustics": labels.acoustics,
            "look": labels.look,
            "sound": np.array(episodes.sounds, dtype=object)[episodes.sound],
            "scene": place.name,
            "seed": episodes.seed,
            "episode": episodes.number,
            "start_cell": start,
            "start_heading": episodes.start % HEADINGS,
            "source": source,
            "source_cell": np.asarray(place.sources)[source],
            "in_sight": place.in_sight[source, start].astype(np.int64),
            "rooms_crossed": distances.crossings[source, start],
            "geodesic": CELL * distances.source_moves[source, start],
            "euclidean": np.hypot(*(centres[start] - centres[np.asarray(place.sources)[source]]).T),
            "end_cell": end,
            "path_length": path,
            "shortest": shortest,
            "actions": actions,
            "fewest_actions": fewest,
            "collisions": simulator.collisions.numpy(),
            "outcome": _outcome(simulator),
            "success": success.astype(np.int64),
            "spl": spl(success, path, shortest),
            "softspl": soft_spl(remaining, path, shortest),
            "sna": sna(success, actions, fewest),
            "dtg": CELL * distances.source_moves[source, end],
        }
    )


def _fewest(simulator: Simulator) -> np.ndarray:
    """Fewest actions that succeed on a walk with p <= l, Stop included, (N,)."""
    episodes, distances = simulator.episodes, simulator.distances
    allowance = distances.allowance[episodes.source, episodes.start // HEADINGS]
    neighbours = simulator.place.grid.neighbours
    costs = fewest_actions(neighbours, distances.goal, int(allowance.max()))
    own = costs[allowance, episodes.source, episodes.start].astype(np.int64)
    return own + int(simulator.protocol.requires_stop)


def _outcome(simulator: Simulator) -> np.ndarray:
    """How each episode ended, in a word."""
    out_of_moves = simulator.attempted >= simulator.max_attempts
    cases = [simulator.success, simulator.stopped, out_of_moves]
    words = ["success", "stopped_elsewhere", "out_of_moves"]
    return np.select([case.numpy() for case in cases], words, "out_of_actions")
