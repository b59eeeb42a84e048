"""Base class of agents, which act in N episodes at once on their observations alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

import torch
from torch import Tensor

from avn.navigation.protocols import Protocol

if TYPE_CHECKING:
    from tensordict import TensorDict

    from avn.navigation.simulator import Simulator


class Agent(ABC):
    """Agent that acts in N episodes at once.

    Attributes
    ----------
    privileged : bool
        True if the agent is given the ground truth before it acts; its rows are bounds and no
        entries of the table.
    explores : bool
        True if the agent is given the exploration trajectory of its episode.
    needs : tuple of str
        Names of the observations that it needs; see `wants`.
    """

    privileged: ClassVar[bool] = False
    explores: bool = False
    needs: ClassVar[tuple[str, ...]] = ()

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes.

        Parameters
        ----------
        n : int
            Number of episodes.
        generator : torch.Generator
            Source of all random numbers of the agent.
        protocol : Protocol
            Actions, goal and limits of the episodes.
        """
        self.n = n
        self.generator = generator
        self.protocol = protocol

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the names of the observations that it needs under a protocol."""
        return self.needs

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the names of its settings that have no effect under a protocol."""
        return ()

    def explore(self, trajectories: TensorDict, trajectory_index: Tensor) -> None:
        """Process the exploration trajectories, after `reset` and before the first action.

        Parameters
        ----------
        trajectories : TensorDict of batch size (W, T)
            Observations at each step of each trajectory; odometry is relative to its first state.
        trajectory_index : (N,) int64 tensor
            Trajectory of each episode.
        """
        return

    def posterior(self, rows: Tensor) -> Tensor | None:
        """Return what it believes about the position of the source, for films and figures.

        Parameters
        ----------
        rows : (R,) int64 tensor
            Episodes.

        Returns
        -------
        (R, M, M) float32 tensor, or None
            Probability of each square of its map, divided by that of the likeliest one; None if it
            keeps no posterior.
        """
        return None

    def set_active(self, active: Tensor) -> None:
        """Set which episodes are not over, (N,) bool, to save work on the others."""
        return

    @abstractmethod
    def act(self, observation: TensorDict) -> Tensor:
        """Choose an action for every episode, including finished ones.

        Parameters
        ----------
        observation : TensorDict
            See `Simulator.observe`.

        Returns
        -------
        (N,) int64
            See `avn.core.actions`.
        """

    def set_ground_truth(self, simulator: Simulator) -> None:
        """Give the ground truth to a privileged agent, after `reset` and before it acts.

        Parameters
        ----------
        simulator : Simulator
            Holds the true map, states and sources.

        Raises
        ------
        PermissionError
            If the agent is not privileged.
        """
        raise PermissionError(f"{type(self).__name__} is not privileged and may not see the truth")
