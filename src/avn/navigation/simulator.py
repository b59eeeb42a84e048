"""The simulator: N episodes in one apartment, moved at once as tensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict
from torch import Tensor

from avn.core.actions import ACTIONS, BACKWARD, HEADINGS, STOP, transitions
from avn.core.random import scramble
from avn.navigation.distances import Distances, measure
from avn.navigation.episodes import Episodes
from avn.navigation.place import Place
from avn.navigation.protocols import Protocol

# Episodes whose takes are drawn at once, so that the 64-bit draws stay in the cache.
_CHUNK = 256
# Unit vectors (east, north) to the right and to the front of headings north, east, south, west.
_RIGHT = np.array([(1, 0), (0, -1), (-1, 0), (0, 1)])
_FRONT = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])


class Simulator:
    """N episodes of one room that run at once.

    Parameters
    ----------
    place : Place
        The apartment: grid, source cells, lines of sight.
    episodes : Episodes
    protocol : Protocol
    hearing : mapping of str to (K, S, sounds, takes, ...) tensor, optional
        What is heard of each source in each state, by the name of the observation: `sound` (..., 2)
        where the source is heard, `reach` (...) how surely it is within reach. Which take an
        episode hears at a step is drawn from the seed, the episode and the step, whoever walks.
    sights : mapping of str to (S, ...) tensor, optional
        What is seen in each state, by the name of the observation: `view`, `depth`, `feature`,
        `window`.

    Attributes
    ----------
    state, source, sound : (N,) int64
        Where the agents are, and what they seek. For privileged agents and for records alone.
    attempted, walked, collisions, actions : (N,) int64
        Moves tried, moves made, moves blocked, and all actions, Stop included.
    max_attempts : (N,) tensor
        Attempted moves that end the episode.
    success, stopped, done : (N,) bool

    Raises
    ------
    ValueError
        Where `hearing` or one of `sights` has another shape.
    """

    def __init__(
        self,
        place: Place,
        episodes: Episodes,
        protocol: Protocol,
        hearing: Mapping[str, Tensor] | None = None,
        sights: Mapping[str, Tensor] | None = None,
    ) -> None:
        self.place = place
        self.episodes = episodes
        self.protocol = protocol
        self.distances: Distances = measure(place, protocol)
        self.source = torch.from_numpy(episodes.source)
        self.sound = torch.from_numpy(episodes.sound)
        self.start = torch.from_numpy(episodes.start)
        self.transitions = torch.from_numpy(transitions(place.grid.neighbours))
        self.max_attempts = self._moves_allowed()
        states = len(self.transitions)
        # The tables lie flat, so that a step gathers rows by one index, which is several times
        # faster than by two or more.
        self._next = self.transitions.reshape(-1)
        goal = np.repeat(self.distances.goal, HEADINGS, axis=1)
        self._goal, self._goal_row = torch.from_numpy(goal.reshape(-1)), self.source * states
        self._seen_from = positions(place.grid.lattice)
        self._frame = self.start % HEADINGS * states
        self._origin = self._seen_from[self._frame + self.start]
        self._hear(hearing)
        self._sights = dict(sights or {})
        for name, seen in self._sights.items():
            if len(seen) != len(self.transitions):
                raise ValueError(
                    f"'{name}' has {len(seen)} rows for {len(self.transitions)} states"
                )
        self.reset()

    def __len__(self) -> int:
        return len(self.start)

    @property
    def walked(self) -> Tensor:
        """Moves made, (N,) int64."""
        return self.attempted - self.collisions

    def reset(self) -> TensorDict:
        """Put every agent back to its start; returns the first observation."""
        count = len(self)
        self.state = self.start.clone()
        self.attempted, self.collisions, self.actions = (
            torch.zeros(count, dtype=torch.int64) for _ in range(3)
        )
        self.success, self.stopped, self.done, self._collided = (
            torch.zeros(count, dtype=torch.bool) for _ in range(4)
        )
        return self.observe()

    def step(self, actions: Tensor) -> TensorDict:
        """Move every agent whose episode still runs by one action.

        Parameters
        ----------
        actions : (N,) int64
            0 forward, 1 backward, 2 rotate left, 3 rotate right, 4 Stop where the protocol has
            it. Those of finished episodes have no effect.

        Returns
        -------
        TensorDict
            See `observe`.

        Raises
        ------
        ValueError
            Where an action is none of the protocol's, or the shape or type is another.
        """
        self._check(actions)
        running = ~self.done
        moving = (actions <= BACKWARD) & running
        following = self._next[self.state * ACTIONS + actions]
        reached = torch.where(running, following, self.state)
        blocked = moving & (reached == self.state)
        self.state = reached
        self.attempted += moving
        self.collisions += blocked
        self.actions += running
        self._collided = torch.where(running, blocked, self._collided)
        self._end(running, actions)
        return self.observe()

    def observe(self) -> TensorDict:
        """What the agents perceive now.

        Returns
        -------
        TensorDict of batch size N
            `collided` (N,) bool, whether the last action was a blocked move; `odometry` (N, 3)
            int64, cells to the right and to the front and quarter turns clockwise since the start,
            in the frame of the start; with hearing what is heard, and with sights what is seen, by
            name.
        """
        odometry = self._seen_from[self._frame + self.state] - self._origin
        observation = {"collided": self._collided.clone(), "odometry": odometry}
        if self._hearing:
            clip = self._clip()
            observation |= {name: heard[clip] for name, heard in self._hearing.items()}
        observation |= {name: seen[self.state] for name, seen in self._sights.items()}
        return TensorDict(observation, batch_size=[len(self)])

    def explored(self) -> tuple[TensorDict, Tensor]:
        """What is observed on the exploration walks, in silence.

        Returns
        -------
        walks : TensorDict of batch size (W, T)
            `collided`, `odometry` since the start of the walk, and what is seen, as in `observe`.
        walk : (N,) int64
            The walk of each episode.
        """
        walks = torch.from_numpy(self.episodes.walks)
        first = walks[:, :1]
        frame = first % HEADINGS * len(self.transitions)
        observed = {
            "collided": torch.zeros(walks.shape, dtype=torch.bool),
            "odometry": self._seen_from[frame + walks] - self._seen_from[frame + first],
        }
        observed |= {name: seen[walks] for name, seen in self._sights.items()}
        return TensorDict(observed, batch_size=walks.shape), torch.from_numpy(self.episodes.walk)

    def _end(self, running: Tensor, actions: Tensor) -> None:
        """Note which episodes end with this action, and how."""
        arrived = running & self._goal[self._goal_row + self.state]
        if self.protocol.says_stop:
            stopping = running & (actions == STOP)
            self.stopped |= stopping
            self.success |= stopping & arrived
            self.done |= stopping
        else:
            self.success |= arrived
            self.done |= arrived
        self.done |= self.attempted >= self.max_attempts
        self.done |= self.actions >= self.protocol.max_actions

    def _moves_allowed(self) -> Tensor:
        """How many moves may be attempted, (N,)."""
        factor = self.protocol.moves_factor
        if factor is None:
            return torch.full((len(self),), self.protocol.max_actions + 1)
        moves = self.distances.source_moves[self.episodes.source, self.episodes.start // HEADINGS]
        return torch.from_numpy(np.ceil(factor * moves))

    def _hear(self, hearing: Mapping[str, Tensor] | None) -> None:
        """Lay the clips of `hearing` out flat, and find the row that each episode begins at."""
        self._hearing: dict[str, Tensor] = {}
        self._takes: Tensor | None = None
        wanted = (len(self.distances.goal), len(self.transitions), len(self.episodes.sounds))
        for name, heard in (hearing or {}).items():
            if heard.dim() < 4 or tuple(heard.shape[:3]) != wanted:
                raise ValueError(
                    f"hearing '{name}' has shape {tuple(heard.shape)}; wanted (sources, states, "
                    f"sounds, takes, ...) with {wanted} in front"
                )
            self._hearing[name] = heard.flatten(0, 3)
            takes = heard.shape[3]
        if not self._hearing:
            return
        if len({len(heard) for heard in self._hearing.values()}) > 1:
            raise ValueError("what is heard differs in its number of takes")
        _, states, sounds = wanted
        self._clips_of_state = sounds * takes
        self._first_clip = self.source * states * self._clips_of_state + self.sound * takes
        if takes > 1:
            draws = self.protocol.max_actions + 1
            self._takes = drawn_takes(self.episodes, draws, takes).reshape(-1)
            self._take_row = torch.arange(len(self)) * draws

    def _clip(self) -> Tensor:
        """The clip that each agent hears now, (N,); the take is drawn anew for every action."""
        clip = self._first_clip + self.state * self._clips_of_state
        if self._takes is None:
            return clip
        return clip + self._takes[self._take_row + self.actions]

    def _check(self, actions: Tensor) -> None:
        if actions.shape != self.state.shape or actions.dtype != torch.int64:
            raise ValueError(
                f"actions are {tuple(actions.shape)} {actions.dtype}; wanted ({len(self)},) int64"
            )
        low, high = (int(end) for end in torch.aminmax(actions))
        if low < 0 or high >= self.protocol.actions:
            action = low if low < 0 else high
            what = "Stop is not an action" if action == STOP else f"{action} is no action"
            raise ValueError(
                f"{what} under protocol '{self.protocol.name}', whose actions are "
                f"0 to {self.protocol.actions - 1}"
            )


def positions(lattice: NDArray[np.int32]) -> Tensor:
    """Where a state lies as an agent sees it that faces each heading, (4 x 4 C, 3) int64.

    By heading of the beholder and state: cells to the right and to the front from the lattice's
    origin, and quarter turns clockwise from the beholder's heading.
    """
    axes = np.stack((_RIGHT, _FRONT), axis=1)
    place = np.repeat(lattice @ axes.transpose(0, 2, 1), HEADINGS, axis=1)
    turn = (np.arange(HEADINGS)[None, :] - np.arange(HEADINGS)[:, None]) % HEADINGS
    turns = np.tile(turn, (1, len(lattice)))[:, :, None]
    return torch.from_numpy(np.concatenate((place, turns), axis=2).reshape(-1, 3).astype(np.int64))


def drawn_takes(
    episodes: Episodes, draws: int, takes: int, rows: Sequence[int] | None = None
) -> Tensor:
    """The take that each episode hears after each number of actions, (N, draws) int16.

    `rows` are the episodes that are asked for, where not all.
    """
    keys, steps = episodes.keys(), np.arange(draws)
    keys = keys if rows is None else keys[rows]
    table = np.empty((len(keys), draws), dtype=np.int16)
    for begin in range(0, len(keys), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        table[part] = scramble(keys[part, None], steps[None, :]) % np.uint64(takes)
    return torch.from_numpy(table)
