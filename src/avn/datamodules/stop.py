"""Clips for the stop classifier: how many moves the goal is away, the goal itself shown often."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.data import Sampler

from avn.acoustics.clips import DrySounds
from avn.acoustics.microphone import Microphone
from avn.core.errors import UserError
from avn.datamodules.sound import ClipSet, SoundData
from avn.dataset.scene import AudibleScene, Scene

# Tells the cells of an apartment, (K, C) bool, at which each source counts as reached.
GoalCells = Callable[[Scene], NDArray[np.bool_]]


def moves_to_goal(scene: Scene, goal: NDArray[np.bool_]) -> Tensor:
    """Moves of the shortest walk to the goal, by source and state; 0 is at the goal.

    Parameters
    ----------
    scene : Scene
        With K sources and C cells.
    goal : (K, C) bool
        Cells at which each source counts as reached.

    Returns
    -------
    (K, 4 C) float32 tensor
    """
    away = np.where(goal[:, None], scene.grid.distances[None], np.iinfo(np.int16).max)
    moves = torch.from_numpy(away.min(axis=2).astype(np.float32))
    return moves.repeat_interleave(4, dim=1)


class StopData(SoundData):
    """What the stop classifier is trained and validated on; the target is `moves_to_goal`.

    Parameters
    ----------
    train, validation, sounds, microphone
        As `SoundData` takes them.
    recipe : Any
        Its `positives` is the share of training clips that are heard at the goal.
    goal : callable
        Scene to (K, C) bool, the protocol's goal.
    """

    node = "stop_model"
    what = "stop classifier"

    def __init__(
        self,
        train: Sequence[AudibleScene],
        validation: Sequence[AudibleScene],
        sounds: DrySounds,
        microphone: Microphone,
        recipe: Any,
        goal: GoalCells,
    ) -> None:
        self.goal = goal
        super().__init__(train, validation, sounds, microphone, recipe)
        self.positives = recipe.positives
        if not 0 < float(self.train_clips.target.eq(0).float().mean()) < 1:
            raise UserError(
                "protocol.radius: every cell of the training apartments is at the goal, or none "
                "is; give a radius between"
            )

    @property
    def prior(self) -> float:
        """Share of pairs of source and state in the training apartments that are at the goal."""
        return float(self.train_clips.target.eq(0).double().mean())

    def target_of(self, scene: Scene) -> Tensor:
        """Moves to the goal of each source from each state, (K, S)."""
        return moves_to_goal(scene, self.goal(scene))

    def train_sampler(self) -> Sampler[int]:
        """An epoch in which the share `positives` is heard at the goal."""
        return GoalBalancedSampler(
            self.train_clips, self.recipe.train_seed, self.recipe.sounds_per_pair, self.positives
        )


class GoalBalancedSampler(Sampler[int]):
    """The items of a training epoch in a random order, many of them at the goal.

    An epoch has as many clips as there are pairs, times `sounds_per_pair`. Pairs at the goal come
    several times, each time in another take and with a sound drawn anew; of the other pairs,
    some are left out. All is drawn from the seed and the epoch alone.

    Parameters
    ----------
    clips : ClipSet
        Its target is 0 at the goal.
    seed, sounds_per_pair : int
    positives : float
        Share of clips at the goal.
    """

    def __init__(self, clips: ClipSet, seed: int, sounds_per_pair: int, positives: float) -> None:
        self.clips, self.seed, self.epoch = clips, seed, 0
        at_goal = clips.target == 0
        self.at_goal, self.elsewhere = at_goal.nonzero()[:, 0], (~at_goal).nonzero()[:, 0]
        self.count = clips.pairs * sounds_per_pair
        self.positives = round(positives * self.count)
        groups = (self.positives, self.at_goal), (self.count - self.positives, self.elsewhere)
        # So many takes of a pair there are at most in one epoch.
        self.realisations = max(-(-count // len(pairs)) for count, pairs in groups)

    def set_epoch(self, epoch: int) -> None:
        """Called by the trainer before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        return self.count

    def __iter__(self) -> Iterator[int]:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        items = torch.cat(
            [
                self._drawn(self.at_goal, self.positives, generator),
                self._drawn(self.elsewhere, self.count - self.positives, generator),
            ]
        )
        yield from items[torch.randperm(len(items), generator=generator)].tolist()

    def _drawn(self, pairs: Tensor, count: int, generator: torch.Generator) -> Tensor:
        """`count` items of some pairs: each pair once before any comes twice."""
        rounds = torch.arange(count) // len(pairs)
        order = torch.randperm(len(pairs), generator=generator)
        pair = pairs[order[torch.arange(count) % len(pairs)]]
        names = len(self.clips.sounds.names)
        sound = torch.randint(names, (count,), generator=generator)
        realisation = self.epoch * self.realisations + rounds
        return (realisation * self.clips.pairs + pair) * names + sound
