"""Base class of mappers, which map the apartment for N agents and localise them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from torch import Tensor

from avn.core.errors import UserError
from avn.planning.partial_graph import GraphRules, PartialGraph

if TYPE_CHECKING:
    from tensordict import TensorDict

    from avn.navigation.simulator import Simulator


class Mapper(ABC):
    """Map of the apartment for each of N agents.

    Attributes
    ----------
    needs : tuple of str
        Names of the observations that it needs.
    explores : bool
        True if it is given the exploration trajectory.
    pose : (N, 3) int64 tensor
        Column, row and heading of the agents on their maps.
    location : (N, 2) float64 tensor
        Column and row before rounding to a square.
    graph : PartialGraph
        Nodes and edges for the planner.
    sound_graph : PartialGraph or None
        Where sound can go, which passes over furniture; None where it goes as the agent does.
    ground_truths : tuple of str
        Parts of the ground truth that it can be given: `map`, `pose`.
    in_exploration_frame : bool
        True if the map lies in the frame of the exploration trajectory, False if it lies in the
        frame of the start.
    retrieved : (N, k) float32 and (N, k, 3) int64 tensors, or None
        Entries that the spatial memory returned last, for figures: cosine similarities, and poses
        in the frame of the exploration trajectory.
    """

    needs: ClassVar[tuple[str, ...]] = ()
    ground_truths: ClassVar[tuple[str, ...]] = ()
    explores: ClassVar[bool] = False
    pose: Tensor
    location: Tensor
    graph: PartialGraph
    sound_graph: PartialGraph | None = None
    in_exploration_frame: bool = False
    retrieved: tuple[Tensor, Tensor] | None = None

    def unused_settings(self) -> tuple[str, ...]:
        """Return the names of its settings that have no effect."""
        return ()

    @abstractmethod
    def reset(self, n: int, rules: GraphRules) -> None:
        """Begin N new episodes with empty maps.

        Parameters
        ----------
        n : int
            Number of episodes.
        rules : GraphRules
            Rules of the graph.
        """

    def belief(self, rows: Tensor) -> Tensor | None:
        """Return the probability that each square of some agents' maps is free, for figures.

        Parameters
        ----------
        rows : (R,) int64 tensor
            Numbers of the agents.

        Returns
        -------
        (R, M, M) float32 tensor, or None
            By square to the front and square to the right; None without such a map.
        """
        return None

    def explore(self, trajectories: TensorDict, trajectory_index: Tensor) -> None:
        """Process the exploration trajectories, after `reset` and before the first observation.

        Parameters
        ----------
        trajectories : TensorDict of batch size (W, T)
            Observations at each step of each trajectory; odometry is relative to its first state.
        trajectory_index : (N,) int64 tensor
            Trajectory of each agent.
        """
        return

    def set_ground_truth(self, part: str, simulator: Simulator) -> None:
        """Set a part of the ground truth, for ablations.

        Parameters
        ----------
        part : {"map", "pose"}
            The true map, or the true pose of the start in the exploration frame.
        simulator : Simulator
            Holds the true grid and states.

        Raises
        ------
        UserError
            If the mapper has no use for the part.
        """
        raise UserError(
            f"agent.oracle_inputs: '{part}' is nothing that {type(self).__name__} can be shown"
        )

    def set_active(self, active: Tensor) -> None:
        """Set which episodes are not over, (N,) bool, to save work on the others."""
        return

    @abstractmethod
    def observe(self, observation: TensorDict, direction: Tensor) -> None:
        """Localise the agents, and update map and graph with the newest observations.

        Parameters
        ----------
        observation : TensorDict of batch size (N,)
            See `Simulator.observe`.
        direction : (N,) int64 tensor
            Direction of the last action, quarter turns from the heading: 0 for a move forward, 2
            for a move backward; -1 for any other action.
        """
