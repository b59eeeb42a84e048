"""Apartments as concatenated tables, in which a step of the simulation is a lookup."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.core.actions import ACTIONS, BACKWARD, HEADINGS, transitions
from avn.core.clip_id import ClipId
from avn.core.sound_mix import SoundMix
from avn.navigation.distances import measure
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.observations import RenderedAudio, SceneObservations
from avn.navigation.protocols import Protocol

# Unit vectors (east, north) to the right and to the front of headings north, east, south, west.
_RIGHT = np.array([(1, 0), (0, -1), (-1, 0), (0, 1)])
_FRONT = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])


@dataclass(frozen=True)
class SceneBatch:
    """Tables of R apartments with S states and Q sources in total.

    States and sources are numbered over all apartments. All attributes are tensors or plain
    values, so that the batch can be sent to other processes.

    Attributes
    ----------
    following : (S * 5,) int64
        State after each action.
    scene : (S,) int64
        Apartment of each state.
    first_state : (R + 1,) int64
        First state of each apartment, and S.
    source_scene : (Q,) int64
        Apartment of each source.
    goal, goal_row : (...,) bool, (Q,) int64
        `goal[goal_row[source] + state]` is True if the state is at the goal of the source.
    moves : (...,) int64
        Moves to the cell of the source, in the layout of `goal`.
    most_moves : (...,) int64
        Attempted moves that end an episode from each state, in the layout of `goal`.
    clip_row : (Q,) int64
        Row of the first clip of each source; see `clip`.
    sounds, realisations : int
        Number of sounds, and of realisations of each clip.
    shortest : (...,) float64
        The l of SPL from each state, in the layout of `goal`; see `Distances`.
    poses : (4 * S, 3) int64
        See `relative_poses`.
    audio : dict of str to (clips, ...) tensor
        Audio observations of all clips, by name.
    visual : dict of str to (S, ...) tensor
        Visual observations of all states, by name.
    rendered : dict of str to list of RenderedAudio
        Audio observations that are rendered when they are heard, for each apartment, by name.
    """

    following: Tensor
    scene: Tensor
    first_state: Tensor
    source_scene: Tensor
    goal: Tensor
    goal_row: Tensor
    moves: Tensor
    most_moves: Tensor
    shortest: Tensor
    clip_row: Tensor
    sounds: int
    realisations: int
    poses: Tensor
    audio: dict[str, Tensor]
    visual: dict[str, Tensor]
    rendered: dict[str, list[RenderedAudio]] = field(default_factory=dict)

    @property
    def states(self) -> int:
        """Number of states of all apartments, S."""
        return len(self.scene)

    @property
    def clips_of_state(self) -> int:
        """Number of clips of one source in one state."""
        return self.sounds * self.realisations

    @property
    def clips(self) -> int:
        """Number of clips of all sources in all states."""
        return len(self.goal) * self.clips_of_state

    def clip(self, clip: ClipId) -> Tensor:
        """Return the rows of clips in the tensors of `audio`, (N,) int64."""
        first = self.clip_row[clip.source] + clip.state * self.clips_of_state
        return first + clip.sound * self.realisations + clip.realisation

    def first_source(self) -> Tensor:
        """Return the number of the first source of each apartment, (R,) int64."""
        return torch.searchsorted(self.source_scene, torch.arange(len(self.first_state) - 1))

    def render(
        self, clip: ClipId, wanted: Tensor | None = None, mix: SoundMix | None = None
    ) -> dict[str, Tensor]:
        """Render the audio observations that are in no table.

        Parameters
        ----------
        clip : ClipId
            Clips of N agents.
        wanted : (N,) bool tensor, optional
            Agents that hear; the observations of the others are 0.
        mix : SoundMix, optional
            What the agents hear besides the steady sound of their source; its sources are those
            of the agent's apartment.

        Returns
        -------
        dict of str to (N, ...) float32 tensor
        """
        if not self.rendered:
            return {}
        scene = self.source_scene[clip.source]
        found = {
            name: torch.zeros(len(scene), *each[0].shape) for name, each in self.rendered.items()
        }
        first_source = self.first_source()
        for number in range(len(self.first_state) - 1):
            here = (scene == number) if wanted is None else (scene == number) & wanted
            rows = here.nonzero()[:, 0]
            if len(rows):
                source, state, *others = (part[rows] for part in clip)
                local = source - first_source[number], state - self.first_state[number]
                own = ClipId(*local, *others)
                for name, each in self.rendered.items():
                    found[name][rows] = each[number](own, mix and mix.rows(rows))
        return found

    def origin(self, start: Tensor) -> tuple[Tensor, Tensor]:
        """Return the first row of `poses` in the frame of each start, and the pose of the start."""
        frame = start % HEADINGS * self.states
        return frame, self.poses[frame + start]

    def odometry(
        self, start: Tensor, state: Tensor, origin: tuple[Tensor, Tensor] | None = None
    ) -> Tensor:
        """Return the poses of states relative to starts.

        Parameters
        ----------
        start, state : int64 tensors
            States of the same shape, or shapes that broadcast.
        origin : (Tensor, Tensor), optional
            Result of `origin` for the starts, to save the lookup at every step.

        Returns
        -------
        (..., 3) int64
            Cells to the right, cells to the front and quarter turns clockwise, in the frame of
            the start.
        """
        frame, begin = origin or self.origin(start)
        return self.poses[frame + state] - begin


def advance(
    tables: SceneBatch, goal_row: Tensor, state: Tensor, action: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Move N agents by one action, in evaluation and in training alike.

    Parameters
    ----------
    tables : SceneBatch
        Apartments.
    goal_row, state : (N,) int64
        `tables.goal_row` of the source that each agent seeks, and its state.
    action : (N,) int64
        See `avn.core.actions`.

    Returns
    -------
    state : (N,) int64
        State after the action; a blocked move does not change it.
    blocked : (N,) bool
        True if a move was attempted and blocked.
    arrived : (N,) bool
        True if the agent is at the goal after the action.
    """
    following = tables.following[state * ACTIONS + action]
    blocked = (action <= BACKWARD) & (following == state)
    return following, blocked, tables.goal[goal_row + following]


def build_scene_batch(
    scenes: Sequence[NavigationScene],
    protocol: Protocol,
    observations: Sequence[SceneObservations] = (),
    sounds: int = 1,
) -> SceneBatch:
    """Concatenate the tables of several apartments.

    Parameters
    ----------
    scenes : sequence of NavigationScene
        Apartments.
    protocol : Protocol
        Defines the goal cells.
    observations : sequence of SceneObservations, optional
        Observations of each apartment, with the same names in all.
    sounds : int
        Number of sounds without audio observations.

    Returns
    -------
    SceneBatch

    Raises
    ------
    ValueError
        If an observation has another shape than its apartment.
    """
    observed = [*observations] or [SceneObservations()] * len(scenes)
    states = np.cumsum([0] + [HEADINGS * len(scene.grid.lattice) for scene in scenes])
    sounds, realisations = observed[0].sounds or sounds, observed[0].realisations
    for scene, own, count in zip(scenes, observed, np.diff(states), strict=True):
        own.check(len(scene.sources), int(count), sounds)
    distances = [measure(scene, protocol) for scene in scenes]
    sources = [len(scene.sources) for scene in scenes]
    offsets = torch.from_numpy(states[:-1])
    source_scene = torch.from_numpy(np.repeat(np.arange(len(scenes)), sources))
    # the rows of all sources of an apartment, then those of the next
    own_states = torch.from_numpy(np.diff(states))[source_scene]
    row = torch.cumsum(own_states, 0) - own_states - offsets[source_scene]
    return SceneBatch(
        following=_laid_out([transitions(s.grid.neighbours) for s in scenes], offsets),
        scene=torch.from_numpy(np.repeat(np.arange(len(scenes)), np.diff(states))),
        first_state=torch.from_numpy(states),
        source_scene=source_scene,
        goal=_by_state([d.goal for d in distances]),
        goal_row=row,
        moves=_by_state([d.source_moves for d in distances]),
        most_moves=_by_state([d.most_moves for d in distances]),
        shortest=_by_state([d.shortest for d in distances]),
        clip_row=row * sounds * realisations,
        sounds=sounds,
        realisations=realisations,
        poses=_poses(scenes),
        audio={
            name: _joined([own.audio[name].flatten(0, 3) for own in observed])
            for name in observed[0].audio
        },
        visual={
            name: _joined([own.visual[name] for own in observed]) for name in observed[0].visual
        },
        rendered={name: [own.rendered[name] for own in observed] for name in observed[0].rendered},
    )


def _joined(tensors: Sequence[Tensor]) -> Tensor:
    return tensors[0] if len(tensors) == 1 else torch.cat([*tensors])  # one needs no copy


def _laid_out(tables: Sequence[np.ndarray], offsets: Tensor) -> Tensor:
    moved = [torch.from_numpy(t) + offset for t, offset in zip(tables, offsets, strict=True)]
    return torch.cat(moved).reshape(-1)


def _by_state(tables: Sequence[np.ndarray]) -> Tensor:
    """(K, C) of each apartment, repeated for the four headings of a cell, one after another."""
    return torch.cat([torch.from_numpy(np.repeat(t, HEADINGS, axis=1)).flatten() for t in tables])


def _poses(scenes: Sequence[NavigationScene]) -> Tensor:
    each = [relative_poses(s.grid.lattice).unflatten(0, (HEADINGS, -1)) for s in scenes]
    return torch.cat(each, dim=1).flatten(0, 1)


def relative_poses(lattice: NDArray[np.int32]) -> Tensor:
    """Compute the pose of every state in the frame of each heading.

    Parameters
    ----------
    lattice : (C, 2) int32
        Column and row of each cell.

    Returns
    -------
    (4 * 4 C, 3) int64
        By heading of the frame and by state: cells to the right and to the front of the lattice's
        origin, and quarter turns clockwise from the heading of the frame.
    """
    axes = np.stack((_RIGHT, _FRONT), axis=1)
    position = np.repeat(lattice @ axes.transpose(0, 2, 1), HEADINGS, axis=1)
    turn = (np.arange(HEADINGS)[None, :] - np.arange(HEADINGS)[:, None]) % HEADINGS
    turns = np.tile(turn, (1, len(lattice)))[:, :, None]
    return torch.from_numpy(
        np.concatenate((position, turns), axis=2).reshape(-1, 3).astype(np.int64)
    )
