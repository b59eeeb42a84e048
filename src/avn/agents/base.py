"""What an agent is: it moves N episodes at once, and knows what it observes and no more."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.navigation.protocols import Protocol

if TYPE_CHECKING:
    from avn.navigation.simulator import Simulator


class Agent(ABC):
    """An agent that acts in N episodes at once.

    Attributes
    ----------
    privileged : bool
        Whether the agent is shown the simulator before it acts; such rows are bounds and no
        entries of the table.
    explores : bool
        Whether it is shown the exploration walk of its episode.
    needs : tuple of str
        Observations without which it cannot act; see `wants`.
    """

    privileged: ClassVar[bool] = False
    explores: bool = False
    needs: ClassVar[tuple[str, ...]] = ()

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes.

        Parameters
        ----------
        n : int
        generator : torch.Generator
            Where all that the agent draws comes from.
        protocol : Protocol
            The rules: which actions there are, and when to say Stop.
        """
        self.n = n
        self.generator = generator
        self.protocol = protocol

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """Observations that it cannot do without under a protocol."""
        return self.needs

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Settings of its own that make no difference under a protocol, by name."""
        return ()

    def explore(self, walks: TensorDict, walk: Tensor) -> None:
        """Be shown exploration walks, after `reset` and before the first action.

        Parameters
        ----------
        walks : TensorDict of batch size (W, T)
            What is observed at each step of each walk; odometry counts from its own start.
        walk : (N,) int64 tensor
            Which walk belongs to each episode.
        """
        return

    def rest(self, done: Tensor) -> None:
        """Be told which episodes are over, (N,) bool, to save the work of acting in them."""
        return

    @abstractmethod
    def act(self, observation: TensorDict) -> Tensor:
        """Choose an action for every episode, finished ones included.

        Parameters
        ----------
        observation : TensorDict
            See `Simulator.observe`.

        Returns
        -------
        (N,) int64
        """

    def reveal(self, simulator: Simulator) -> None:
        """Show the truth to a privileged agent, after `reset` and before it acts."""
        raise PermissionError(f"{type(self).__name__} is not privileged and may not see the truth")
