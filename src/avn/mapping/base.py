"""What a mapper is: it remembers the place for N agents at once, and says where they are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from tensordict import TensorDict
from torch import Tensor

from avn.core.errors import UserError
from avn.planning.partial_graph import GraphRules, PartialGraph

if TYPE_CHECKING:
    from avn.navigation.simulator import Simulator


class Mapper(ABC):
    """Remembers the place for N agents.

    Attributes
    ----------
    needs : tuple of str
        Observations without which it cannot map.
    explores : bool
        Whether it is shown the exploration walk.
    pose : (N, 3) int64 tensor
        Column, row and heading of the agents on their maps.
    location : (N, 2) float64 tensor
        Column and row before they are rounded to a square.
    graph : PartialGraph
        Nodes and edges that the planner plans on.
    reveals : tuple of str
        Parts of the truth that it can be shown: `map`, `pose`.
    in_walk : bool
        Whether the map lies in the frame of the exploration walk, not in that of the start.
    retrieved : (N, k) float32 and (N, k, 3) int64 tensors, or None
        What a memory returned last, for pictures: cosines and places in the frame of the walk.
    """

    needs: ClassVar[tuple[str, ...]] = ()
    reveals: ClassVar[tuple[str, ...]] = ()
    explores: ClassVar[bool] = False
    pose: Tensor
    location: Tensor
    graph: PartialGraph
    in_walk: bool = False
    retrieved: tuple[Tensor, Tensor] | None = None

    def unused_settings(self) -> tuple[str, ...]:
        """Settings of its own that make no difference to it, by name."""
        return ()

    @abstractmethod
    def reset(self, n: int, rules: GraphRules) -> None:
        """Begin N new episodes, of which nothing is known."""

    def belief(self, rows: Tensor) -> Tensor | None:
        """Probability that each square of some agents' maps is free, for pictures.

        Parameters
        ----------
        rows : (R,) int64 tensor

        Returns
        -------
        (R, M, M) float32 tensor, or None
            By square to the front and to the right; None where it has no such map.
        """
        return None

    def explore(self, walks: TensorDict, walk: Tensor) -> None:
        """Remember exploration walks.

        Parameters
        ----------
        walks : TensorDict of batch size (W, T)
            What was observed at each step of each walk, odometry since its own start.
        walk : (N,) int64 tensor
            Which walk each agent made.
        """
        return

    def reveal(self, part: str, simulator: Simulator) -> None:
        """Take in a part of the truth, for ablations: the true `map`, or the true `pose`.

        Raises
        ------
        UserError
            Where this mapper has no use for it.
        """
        raise UserError(
            f"agent.oracle_inputs: '{part}' is nothing that {type(self).__name__} can be shown"
        )

    def rest(self, done: Tensor) -> None:
        """Be told which agents' episodes are over, (N,) bool, to save the work for them."""
        return

    @abstractmethod
    def observe(self, observation: TensorDict, way: Tensor) -> None:
        """Take in the newest observations: find the agents, and bring map and graph up to date.

        Parameters
        ----------
        observation : TensorDict of batch size (N,)
        way : (N,) int64 tensor
            0 where the last action was a move forward, 2 a move backward, -1 none of both.
        """
